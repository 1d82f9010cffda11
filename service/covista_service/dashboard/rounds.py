"""Looks after the station are made once for all who ask at the same time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from covista_service.telemetry import Summary

# Who asks within so long is told the same; latencies are sorted for their summary, so that is done less often.
_FRESH_S, _SUMMARY_S = 1.0, 5.0


class Rounds:
    """The last look, and the last summary of what was measured; for the thread of the event loop alone."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._told: tuple[float, bytes] = (-math.inf, b"")
        self._summary: tuple[float, Summary | None] = (-math.inf, None)

    def told(self, look: Callable[[], bytes]) -> bytes:
        """What the last look found; a new one where that is old."""
        now_s = self._clock()
        if now_s - self._told[0] >= _FRESH_S:
            self._told = now_s, look()
        return self._told[1]

    def summary(self, sum_up: Callable[[], Summary]) -> Summary:
        """What was measured so far, or a few seconds ago."""
        now_s, (made_s, found) = self._clock(), self._summary
        if found is None or now_s - made_s >= _SUMMARY_S:
            found = sum_up()
            self._summary = now_s, found
        return found
