"""So many lines a minute and no more, whatever a swarm sends: then one line says how many were left out."""

from __future__ import annotations

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

Key = tuple[str, ...]
_ALL: Key = ()
_OTHERS: Key = ("others",)


@dataclass(frozen=True, slots=True)
class RateLimitOptions:
    """Lines about one robot of one kind, of one kind, and in all, in a window.

    A kind is a logger with an unformatted message. Kinds beyond `kinds` share one account, and so do robots beyond
    `robots`.
    """

    of_robot: int = 6
    of_kind: int = 60
    in_all: int = 1200
    window_s: float = 60.0
    kinds: int = 200
    robots: int = 10_000


class RateLimit(logging.Filter):
    """Lets through what is within the limits; `tell` is given what stands for the rest, once the window is over.

    That shows when the next record comes.
    """

    def __init__(
        self,
        tell: Callable[[logging.LogRecord], object],
        options: RateLimitOptions | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__()
        self._tell = tell
        self._options = options or RateLimitOptions()
        self._clock = clock
        self._lock = threading.Lock()
        self._begun_s = clock()
        self._of_robot: Counter[Key] = Counter()
        self._of_kind: Counter[Key] = Counter()
        self._in_all: Counter[Key] = Counter()
        self._left_out: dict[Key, tuple[logging.LogRecord, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Is there room for this record?"""
        with self._lock:
            over = self._clock() - self._begun_s >= self._options.window_s
            told = self._begin_anew() if over else []
            passes = self._enter(record)
        for summary in told:
            self._tell(summary)
        return passes

    def _enter(self, record: logging.LogRecord) -> bool:
        most = self._options
        kind = _account(self._of_kind, (record.name, str(record.msg)), most.kinds)
        accounts = [(self._in_all, _ALL, most.in_all), (self._of_kind, kind, most.of_kind)]
        if subject := subject_of(record):
            robot = _account(self._of_robot, (*kind, subject), most.robots)
            accounts.append((self._of_robot, robot, most.of_robot))
        if any(counts[key] >= limit for counts, key, limit in accounts):
            self._left_out[kind] = (record, self._left_out.get(kind, (record, 0))[1] + 1)
            return False
        for counts, key, _ in accounts:
            counts[key] += 1
        return True

    def _begin_anew(self) -> list[logging.LogRecord]:
        told = [_stands_for(count, record) for record, count in self._left_out.values()]
        self._left_out = {}
        for counts in (self._of_robot, self._of_kind, self._in_all):
            counts.clear()
        self._begun_s = self._clock()
        return told


def subject_of(record: logging.LogRecord) -> str:
    """The robot, or the pair, that a record is about; empty if it is about none."""
    fields = getattr(record, "fields", {})
    return str(fields.get("robot") or fields.get("pair") or "")


def _account(counts: Counter[Key], key: Key, most: int) -> Key:
    return key if key in counts or len(counts) < most else _OTHERS


def _stands_for(count: int, record: logging.LogRecord) -> logging.LogRecord:
    told = logging.LogRecord(record.name, record.levelno, record.pathname, record.lineno, "lines left out", None, None)
    told.fields = {"left_out": count, "kind": str(record.msg)}
    return told
