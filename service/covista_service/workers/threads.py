"""Jobs in threads of this process."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from covista_service.loop import CrewStatus
from covista_service.workers.jobs import Job, begin_to_work

_T = TypeVar("_T")


class Threads:
    """`count` threads: nothing travels, nothing is lost, and no job can be ended from outside."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._pool = ThreadPoolExecutor(count, "covista-worker", initializer=begin_to_work)

    def submit(self, job: Job[_T]) -> Future[_T]:
        """Have a job done. Raises RuntimeError where the pool is closed."""
        return self._pool.submit(job.here)

    def status(self) -> CrewStatus:
        """Threads are always well."""
        return CrewStatus("threads", self._count)

    def close(self) -> None:
        """Let jobs under way end, and drop those that wait."""
        self._pool.shutdown(wait=True, cancel_futures=True)
