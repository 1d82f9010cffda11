"""The station's workers, wherever they are."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from typing import TypeVar

from covista_service.loop import Built, CrewStatus, Extraction
from covista_service.perception.comparison import Comparison
from covista_service.perception.scene import SceneOptions
from covista_service.perception.warming import warm_up
from covista_service.station.events import BuildSurfaces, Keyframe, SurveyPair
from covista_service.telemetry import JobKind
from covista_service.workers import daemon, jobs
from covista_service.workers.cluster import Cluster
from covista_service.workers.jobs import Job
from covista_service.workers.pool import Pool, cancelled
from covista_service.workers.processes import Processes
from covista_service.workers.scheduler import check_kind, scheduler_of
from covista_service.workers.threads import Threads

_T = TypeVar("_T")
# How many seconds a job took where it was done.
Took = Callable[[JobKind, float], None]

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class WorkersOptions:
    """`kind` is threads, processes or dask://HOST:PORT; here `count` jobs run at a time, each on one core.

    A cluster has as many workers as it has; `count` threads stand in for it.
    """

    kind: str = "threads"
    count: int = 2
    scene: SceneOptions = field(default_factory=SceneOptions)


class Workers:
    """Whoever does the heavy work, behind one face."""

    def __init__(self, options: WorkersOptions, took: Took | None = None) -> None:
        """`took` hears how long each job took. Raises ValueError for another kind, and MissingExtraError."""
        self._options = options
        self._took = took
        self._lock = threading.Lock()
        self._closed = False
        self._pool = _pool(options)
        # Overlaps are read in this process. Now is better than when the first robot waits.
        self._loaded = daemon.start(warm_up, "covista-loading")
        self._loaded.add_done_callback(_tell_failure)

    @property
    def warm(self) -> bool:
        """Is compiled code loaded, so that no keyframe has to wait for it?"""
        return self.status().warm

    @property
    def capacity(self) -> int:
        """How many jobs can run at a time, just now."""
        return self._pool.status().capacity

    def status(self) -> CrewStatus:
        """How the workers are; cheap, and for any thread. `warm` speaks for this process too."""
        status = self._pool.status()
        return replace(status, warm=status.warm and self._loaded.done())

    def extract(self, keyframe: Keyframe) -> Future[Extraction]:
        """Decode the keyframe's image and extract its features and a thumbnail.

        Fails with DecodeError where it is no such image. Raises ValueError where there is none.
        """
        return self._timed("extract", jobs.extraction_of(keyframe))

    def survey(self, job: SurveyPair) -> Future[Comparison]:
        """Survey a pair."""
        return self._timed("compare", jobs.survey_of(job, self._options.scene.comparison))

    def build(self, job: BuildSurfaces) -> Future[Built]:
        """Settle poses and surfaces."""
        return self._timed("build", jobs.building_of(job, self._options.scene))

    def submit(self, job: Job[_T]) -> Future[_T]:
        """Have any job done; its future fails with what the job raises, or JobLostError."""
        with self._lock:
            return cancelled() if self._closed else self._pool.submit(job)

    def _timed(self, kind: JobKind, job: Job[_T]) -> Future[_T]:
        whole: Future[_T] = Future()
        self.submit(jobs.timed(job)).add_done_callback(lambda done: self._finish(kind, done, whole))
        return whole

    def _finish(self, kind: JobKind, done: Future[tuple[_T, float]], whole: Future[_T]) -> None:
        """Runs in a worker's thread."""
        if done.cancelled():
            whole.cancel()
            return
        if not whole.set_running_or_notify_cancel():
            return
        if (failure := done.exception()) is not None:
            whole.set_exception(failure)
        else:
            result, seconds = done.result()
            if self._took is not None:
                self._took(kind, seconds)
            whole.set_result(result)

    def close(self) -> None:
        """Let jobs under way end, and drop those that wait."""
        with self._lock:
            self._closed = True
        self._pool.close()


def _pool(options: WorkersOptions) -> Pool:
    check_kind(options.kind)
    scheduler = scheduler_of(options.kind)
    if scheduler is not None:
        return Cluster(scheduler, options.count)
    if options.kind == "threads":
        return Threads(options.count)
    if options.kind == "processes":
        return Processes(options.count)
    raise ValueError(f"no such workers: {options.kind}")


def _tell_failure(loading: Future[None]) -> None:
    if not loading.cancelled() and (failure := loading.exception()) is not None:
        log.warning("compiled code could not be loaded ahead; the first keyframes will wait for it", exc_info=failure)
