"""Where the heavy work runs: threads of this process, processes of their own, or a Dask cluster.

OpenCV, BLAS and numba let go of the interpreter's lock while they compute, so threads do well; processes keep the rest
of the station undisturbed, and survive a picture that crashes a decoder; a cluster has more cores than one machine.
"""

from covista_service.workers.crew import Workers, WorkersOptions
from covista_service.workers.jobs import build, extract, load
from covista_service.workers.pool import JobLostError
from covista_service.workers.scheduler import check_kind

__all__ = ["JobLostError", "Workers", "WorkersOptions", "build", "check_kind", "extract", "load"]
