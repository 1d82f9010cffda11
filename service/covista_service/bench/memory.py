"""How much memory does a robot take, and does a station that is loaded steadily grow?"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

from covista_clients.simulation.marching import March

from covista_service.bench.load import LoadOptions
from covista_service.bench.rig import Rig, free_endpoint, rig
from covista_service.bench.row import Row
from covista_service.bench.trend import trend_of

ROBOTS, LONG_ROBOTS = 200, 1000
MOST_PER_ROBOT_MB = 1.0
# Growth over the whole time that is none to speak of.
FLAT_SHARE = 0.01
_MB = 1e6
_FEATURES = 500
_COMING_PER_S = 30.0
_SETTLE_S, _LONG_SETTLE_S = 10.0, 60.0
# Of the steady load, by so many robots, in all.
_STEADY_ROBOTS, _KEYFRAMES_PER_S, _POSES_PER_S = 20, 5.0, 20.0
_STEADY_S, _LONG_STEADY_S = 60.0, 600.0
# Before anybody looks: how many of those seconds again.
_WARM_SHARE = 0.25
_LOOK_S = 0.5


def rows(long: bool) -> Iterator[Row]:
    """`memory/per_robot`: resident memory beyond that of the empty station, by robot, with 500 features in use each.

    `memory/slope`: growth over the last 80 % of a steady load; `spread` is the half width of its 95 % interval.
    """
    yield _per_robot(long)
    yield _slope(long)


def _per_robot(long: bool) -> Row:
    robots = LONG_ROBOTS if long else ROBOTS
    with rig(LoadOptions(free_endpoint(), robots=robots, features=_FEATURES)) as running:
        empty_mb, full_mb = filled(running, robots, _LONG_SETTLE_S if long else _SETTLE_S)
    each_mb = (full_mb - empty_mb) / robots
    return _row("per_robot", each_mb, None, "MB", f"<= {MOST_PER_ROBOT_MB:g} MB", holds=each_mb <= MOST_PER_ROBOT_MB)


def filled(running: Rig, robots: int, settle_s: float) -> tuple[float, float]:
    """Resident megabytes of a station before and after so many robots have sent two keyframes each."""
    empty_mb = running.readings().resident_bytes / _MB
    running.march(March(_COMING_PER_S / robots, 1.0, 2 * robots / _COMING_PER_S))
    running.settle(settle_s)
    return empty_mb, running.readings().resident_bytes / _MB


def _slope(long: bool) -> Row:
    with rig(LoadOptions(free_endpoint(), robots=_STEADY_ROBOTS, features=_FEATURES)) as running:
        trend = trend_of(observed(running, _LONG_STEADY_S if long else _STEADY_S))
    verdict = trend.verdict(FLAT_SHARE * trend.level)
    mark = f"<= {100 * FLAT_SHARE:g} % in all, for sure: {verdict}"
    return _row("slope", trend.slope, trend.margin, "MB/h", mark, holds=verdict == "flat")


def observed(running: Rig, seconds: float) -> list[tuple[float, float]]:
    """Times, s, and resident megabytes while robots send steadily, once they have done so for a while."""
    running.march(March(_KEYFRAMES_PER_S / _STEADY_ROBOTS, _POSES_PER_S / _STEADY_ROBOTS, _WARM_SHARE * seconds))
    running.start(March(_KEYFRAMES_PER_S / _STEADY_ROBOTS, _POSES_PER_S / _STEADY_ROBOTS, seconds))
    looks: list[tuple[float, float]] = []
    end_s, pause = time.monotonic() + seconds, threading.Event()
    while time.monotonic() < end_s:
        now = running.readings()
        looks.append((now.at_s, now.resident_bytes / _MB))
        pause.wait(_LOOK_S)
    running.sent()
    return looks


def _row(case: str, figure: float, margin: float | None, unit: str, mark: str, *, holds: bool) -> Row:
    return Row(
        bench="memory",
        case=case,
        median=figure,
        spread=margin,
        unit=unit,
        peer=None,
        peer_median=None,
        mark=mark,
        holds=holds,
    )
