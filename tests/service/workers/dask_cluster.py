"""A real Dask cluster on this machine: a scheduler and workers, each a process that ends with the test."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from tests.service.deadline import free_endpoint

_QUIET = {"DASK_LOGGING__DISTRIBUTED": "error", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


class DaskCluster:
    """Starts and kills; who asks whether anybody is there asks the station."""

    def __init__(self) -> None:
        self.port = int(free_endpoint().rpartition(":")[2])
        self.url = f"dask://127.0.0.1:{self.port}"
        self._processes: list[subprocess.Popen[bytes]] = []

    def scheduler(self) -> subprocess.Popen[bytes]:
        """Start a scheduler, always at the same address."""
        return self._start("dask_scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-show")

    def worker(self) -> subprocess.Popen[bytes]:
        """Start a worker that does one job at a time; it looks for the scheduler for a while."""
        at = f"tcp://127.0.0.1:{self.port}"
        return self._start("dask_worker", at, "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny")

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """End a process as a machine ends that loses its power."""
        process.kill()
        process.wait()

    def end(self) -> None:
        """Leave nothing."""
        for process in self._processes:
            self.kill(process)

    def _start(self, program: str, *arguments: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{program}", *arguments, "--no-dashboard"],
            env={**os.environ, **_QUIET},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._processes.append(process)
        return process


@contextmanager
def dask_cluster() -> Iterator[DaskCluster]:
    """Nothing runs yet; at the end nothing does."""
    cluster = DaskCluster()
    try:
        yield cluster
    finally:
        cluster.end()
