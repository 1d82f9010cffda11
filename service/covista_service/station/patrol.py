"""Every possible pair once in a while, however unlikely it is that the two see anything in common."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np
from numpy.typing import NDArray

from covista_service.station.events import Pair
from covista_service.station.options import NS_PER_S

# One such survey for so many keyframes, and so many a second beside those.
_KEYFRAMES = 16
_PER_S = 6.0
# What has been saved up is spent at once, up to so many.
_MOST_SAVED = 16.0
# Robots looked at for one pair. When all have been looked at in vain, it is not done again for so long.
_ROBOTS = 8
_VAIN_NS = NS_PER_S
_NEVER = np.iinfo(np.int64).min // 2
_FIRST_ROOM = 16
# Room grows by a quarter: it is for pairs.
_ROOM_SHARE = 4
# Who is looked after otherwise, by robot.
Beside = Callable[[str], Collection[str]]
Moments = NDArray[np.int64]


class Patrol:
    """Takes robots in turns, each with the one that it was tried with longest ago.

    A pair is due if one of its keyframes is newer than the last try, and that is `retry_after_ns` old. Tries have a
    budget that follows keyframes and time and not the number of pairs, so with N robots and `rate` tries a second a
    pair waits for at most max(retry_after_ns, N (N - 1) / rate). When each pair was tried last takes 8 N^2 bytes.
    """

    def __init__(self, retry_after_ns: int) -> None:
        self._retry_after_ns = retry_after_ns
        self._slot: dict[str, int] = {}
        self._names: list[str] = []
        # Moments are nanoseconds, one later for each thing that happens, so that any two can be told apart.
        self._moment = 0
        self._tried: Moments = np.full((_FIRST_ROOM, _FIRST_ROOM), _NEVER)
        self._used: Moments = np.full(_FIRST_ROOM, _NEVER)
        self._saved = _MOST_SAVED
        self._counted_ns: int | None = None
        self._turn = 0
        self._vain = 0
        self._vain_ns = 0

    def keyframe(self, robot: str) -> None:
        """A robot has a new keyframe."""
        if robot not in self._slot:
            self._enter(robot)
        self._moment += 1
        self._used[self._slot[robot]] = self._moment
        self._saved = min(self._saved + 1 / _KEYFRAMES, _MOST_SAVED)
        self._vain = 0

    def tried(self, pair: Pair, now_ns: int, *, budgeted: bool) -> None:
        """A survey of a pair begins; `budgeted` if it is one of these."""
        self._moment = max(self._moment + 1, now_ns)
        i, j = (self._slot[robot] for robot in pair)
        self._tried[i, j] = self._tried[j, i] = self._moment
        if budgeted:
            self._saved -= 1

    def next(self, now_ns: int, beside: Beside) -> Pair | None:
        """The next pair to try, None if nothing is due or the budget is spent; pairs with `beside` are not for it."""
        self._count(now_ns)
        rested = 0 <= now_ns - self._vain_ns < _VAIN_NS and self._vain >= len(self._names)
        if self._saved < 1 or rested:
            return None
        for _ in range(min(_ROBOTS, len(self._names))):
            self._turn = (self._turn + 1) % len(self._names)
            robot = self._names[self._turn]
            other = self._due(self._turn, beside(robot), now_ns)
            if other is not None:
                self._vain = 0
                return (robot, other) if robot < other else (other, robot)
            self._vain, self._vain_ns = self._vain + 1, now_ns
        return None

    def forget(self, robot: str) -> None:
        """Drop a robot: the last one moves into its place."""
        slot = self._slot.pop(robot, None)
        if slot is None:
            return
        last = len(self._names) - 1
        name = self._names.pop()
        if slot != last:
            self._names[slot], self._slot[name] = name, slot
            self._used[slot] = self._used[last]
            self._tried[slot, :last] = self._tried[last, :last]
            self._tried[:last, slot] = self._tried[:last, last]
        self._used[last] = self._tried[last] = self._tried[:, last] = _NEVER

    def _count(self, now_ns: int) -> None:
        if self._counted_ns is not None:
            seconds = max(0, now_ns - self._counted_ns) / NS_PER_S
            self._saved = min(self._saved + _PER_S * seconds, _MOST_SAVED)
        self._counted_ns = now_ns

    def _due(self, slot: int, beside: Collection[str], now_ns: int) -> str | None:
        count = len(self._names)
        if len(beside) >= count - 1:
            return None
        tried = self._tried[slot, :count]
        due = np.maximum(self._used[:count], self._used[slot]) > tried
        age_ns = now_ns - tried
        # A clock that was set back must not make a pair wait until it is where it was.
        due &= (age_ns >= self._retry_after_ns) | (age_ns < -NS_PER_S)
        due[[slot, *(self._slot[other] for other in beside)]] = False
        found = int(np.where(due, tried, np.iinfo(np.int64).max).argmin())
        return self._names[found] if due[found] else None

    def _enter(self, robot: str) -> None:
        slot = len(self._names)
        if slot == len(self._used):
            more = slot // _ROOM_SHARE
            wider: Moments = np.full((slot + more, slot + more), _NEVER)
            wider[:slot, :slot] = self._tried
            self._tried = wider
            self._used = np.concatenate((self._used, np.full(more, _NEVER)))
        self._slot[robot] = slot
        self._names.append(robot)
