"""Whose turn it is: robots that wait in a line, each at most once per gap, so that who asks often gets no more.

Who has not had a turn for a gap has it at once. Time is an argument; a clock that is set back costs a turn too early.
"""

from __future__ import annotations

import heapq
from collections import OrderedDict
from dataclasses import dataclass

# Turns that must wait fall due together, this far apart: so many wake-ups at most, however many wait.
GRID_NS = 10_000_000
_NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Pace:
    """A robot's turns are at least `gap_ns` apart; `per_s` bounds the turns of all, of which `burst` may come at once.

    Without `per_s` there is no such bound.
    """

    gap_ns: int
    per_s: int | None = None
    burst: int = 1


class Turns:
    """A line of robots. Each stands in it once."""

    def __init__(self, pace: Pace) -> None:
        self._pace = pace
        # (when, number in line, robot), a heap.
        self._line: list[tuple[int, int, str]] = []
        self._number = 0
        # Turns of the last gap, oldest first.
        self._last_ns: OrderedDict[str, int] = OrderedDict()
        self._allowed = float(pace.burst)
        self._counted_ns = 0

    def stand(self, robot: str, now_ns: int) -> int:
        """Let a robot that does not stand there yet stand in line, and say when its turn is."""
        last_ns = self._last_ns.get(robot)
        due_ns = now_ns
        if last_ns is not None and 0 <= now_ns - last_ns < self._pace.gap_ns:
            due_ns = -(-(last_ns + self._pace.gap_ns) // GRID_NS) * GRID_NS
        self._number += 1
        heapq.heappush(self._line, (due_ns, self._number, robot))
        return due_ns

    def take(self, limit: int, now_ns: int) -> list[str]:
        """Up to `limit` robots whose turn it is, in order; they leave the line."""
        self._forget(now_ns)
        robots = []
        for _ in range(min(limit, self._allowance(now_ns))):
            if not self._line or not self._due(now_ns):
                break
            robot = heapq.heappop(self._line)[2]
            self._last_ns[robot] = now_ns
            self._last_ns.move_to_end(robot)
            robots.append(robot)
        if self._pace.per_s is not None:
            self._allowed -= len(robots)
        return robots

    def next_ns(self, now_ns: int) -> int | None:
        """When the next turn is, perhaps at once; None where nobody waits."""
        if not self._line:
            return None
        if self._allowance(now_ns) < 1:
            return max(self._line[0][0], now_ns + GRID_NS)
        return now_ns if self._due(now_ns) else self._line[0][0]

    def _due(self, now_ns: int) -> bool:
        """Is it the turn of the first in line? Nobody waits longer than a gap, unless the clock was set back."""
        due_ns = self._line[0][0]
        return due_ns <= now_ns or due_ns > now_ns + self._pace.gap_ns + GRID_NS

    def _allowance(self, now_ns: int) -> int:
        """How many may have a turn now."""
        pace = self._pace
        if pace.per_s is None:
            return len(self._line)
        passed_s = max(0, now_ns - self._counted_ns) / _NS_PER_S
        self._counted_ns = now_ns
        self._allowed = min(float(pace.burst), self._allowed + passed_s * pace.per_s)
        return int(self._allowed)

    def _forget(self, now_ns: int) -> None:
        while self._last_ns:
            robot, last_ns = next(iter(self._last_ns.items()))
            if 0 <= now_ns - last_ns < self._pace.gap_ns:
                break
            del self._last_ns[robot]
