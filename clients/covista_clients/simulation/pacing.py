"""When a swarm sends what, and the clocks it goes by."""

from __future__ import annotations

import heapq
import itertools
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True, order=True)
class Due:
    """What is to be sent `t_s` seconds after the beginning: a rover's pose, or a keyframe."""

    t_s: float
    robot: int
    is_keyframe: bool


class Pace(Protocol):
    """Keeps a loop to its times."""

    def wait_until(self, t_s: float) -> bool:
        """Come back `t_s` seconds after the beginning, at once if that is past; False to end."""

    def now_s(self) -> float:
        """Seconds since the beginning."""


class RealTime:
    """The machine's clock, until `stop` is set.

    To wake up costs more than to send: with `grain_s` it sleeps so much longer, and what falls due meanwhile goes out
    together.
    """

    def __init__(self, stop: threading.Event, grain_s: float = 0.0) -> None:
        self._stop = stop
        self._grain_s = grain_s
        self._begin_s = time.monotonic()

    def wait_until(self, t_s: float) -> bool:
        """See Pace."""
        ahead_s = t_s - self.now_s()
        return not self._stop.wait(ahead_s + self._grain_s if ahead_s > 0 else 0.0)

    def now_s(self) -> float:
        """See Pace."""
        return time.monotonic() - self._begin_s


class AtOnce:
    """A clock that is always just as late as asked: the whole schedule runs as quickly as it can."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def wait_until(self, t_s: float) -> bool:
        """See Pace."""
        self._now_s = t_s
        return True

    def now_s(self) -> float:
        """See Pace."""
        return self._now_s


def schedule(robots: int, rate_hz: float, pose_rate_hz: float) -> Iterator[Due]:
    """Everything due, in order, without end; rovers are spread evenly over every period. A rate of 0 means never."""
    rates = ((pose_rate_hz, False), (rate_hz, True))
    return heapq.merge(*(_ticks(robots, rate, is_keyframe) for rate, is_keyframe in rates if rate > 0))


def _ticks(robots: int, rate_hz: float, is_keyframe: bool) -> Iterator[Due]:
    for n in itertools.count():
        yield Due(n / (robots * rate_hz), n % robots, is_keyframe)
