"""Somebody who asks the station over REST all the time, as a dashboard would."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

import httpx

_TIMEOUT_S = 10.0


@dataclass(frozen=True, slots=True)
class Answers:
    """How long answers took, and how many questions had none, or one that says that the station cannot."""

    times_ms: tuple[float, ...]
    failures: int


@dataclass(slots=True)
class Prober(AbstractContextManager["Prober"]):
    """Asks each of the paths so many times a second, from a thread of its own, until closed.

    Who has an answer with a tag asks whether it still stands.
    """

    url: str
    rates_hz: Mapping[str, float]
    _times_ms: list[float] = field(default_factory=list)
    _failures: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _stop: threading.Event = field(default_factory=threading.Event)
    _threads: list[threading.Thread] = field(default_factory=list)

    def __enter__(self) -> Self:
        self._threads = [
            threading.Thread(target=self._ask, args=(path, 1 / rate_hz), name=f"prober {path}")
            for path, rate_hz in self.rates_hz.items()
        ]
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        for thread in self._threads:
            thread.join()

    def answers(self) -> Answers:
        """The answers since this was asked last."""
        with self._lock:
            answers = Answers(tuple(self._times_ms), self._failures)
            self._times_ms, self._failures = [], 0
        return answers

    def _ask(self, path: str, period_s: float) -> None:
        with httpx.Client(base_url=self.url, timeout=_TIMEOUT_S) as client:
            due_s = time.monotonic()
            # One that had to wait for the answer before asks at once; how long it had to wait counts.
            while not self._stop.wait(max(0.0, due_s - time.monotonic())):
                try:
                    answer = client.get(path)
                    failed = answer.is_error
                    if "etag" in answer.headers:
                        client.headers["if-none-match"] = answer.headers["etag"]
                except httpx.HTTPError:
                    failed = True
                with self._lock:
                    self._times_ms.append(1e3 * (time.monotonic() - due_s))
                    self._failures += failed
                due_s += period_s
