"""What all places have in common where jobs run, and what they count."""

from __future__ import annotations

import threading
from collections import Counter
from concurrent.futures import Future
from dataclasses import replace
from typing import Any, Literal, Protocol, TypeVar, cast

from covista_schemas.errors import CovistaError

from covista_service.loop import CrewStatus
from covista_service.workers.jobs import Job

# A job that so many workers died of is not tried again, nor one that so many did not return from.
TRIES = 2
# A survey takes milliseconds, surfaces of many keyframes a tenth of a second: who is silent for so long never answers.
DEADLINE_S = 30.0
# Compiling everything takes half a minute on one core.
LOADING_S = 300.0
_T = TypeVar("_T")

Happening = Literal["lost", "retried", "overdue", "given_up", "shipped_bytes", "shipped_again"]


class JobLostError(CovistaError):
    """A job was given up, since workers died of it or did not return from it; the text says which."""


class Pool(Protocol):
    """An executor of jobs."""

    def submit(self, job: Job[_T]) -> Future[_T]:
        """Have a job done; returns at once. The future is cancelled where the pool is closed."""

    def status(self) -> CrewStatus:
        """How it is."""

    def close(self) -> None:
        """Let jobs under way end, and drop those that wait."""


class Tally:
    """What has happened since the start; for all threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()

    def note(self, what: Happening, count: int = 1) -> None:
        """It has happened, so many times."""
        with self._lock:
            self._counts[what] += count

    def on(self, status: CrewStatus) -> CrewStatus:
        """A status with these counts."""
        with self._lock:
            return replace(status, **cast(dict[str, Any], self._counts))


def cancelled() -> Future[_T]:
    """For a job that nobody waits for any more."""
    future: Future[_T] = Future()
    future.cancel()
    future.set_running_or_notify_cancel()
    return future
