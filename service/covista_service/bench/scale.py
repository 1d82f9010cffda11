"""Does the work for a keyframe follow the number of neighbours, or the number of robots?

Crowds of more and more robots stand at the same density, and send as many keyframes and poses a second in all. So what
the station does for a keyframe can be compared: surveys, and seconds of its processor time. Before that every robot
has sent a keyframe, and all that comes of it is done.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from covista_clients.simulation.marching import March

from covista_service.bench import load
from covista_service.bench.brute_force import brute_force_ms
from covista_service.bench.load import LoadOptions
from covista_service.bench.rig import Rig, Window, free_endpoint, rig
from covista_service.bench.row import Row, median, quantile, spread

SIZES, LONG_SIZES = (50, 200), (50, 100, 200, 500, 1000)
# In all, whatever the number of robots.
KEYFRAMES_PER_S, POSES_PER_S = 6.0, 50.0
MOST_SURVEYS, LEAST_SURVEYS, MOST_CPU = 1.2, 0.8, 2.0
PEER = "OpenCV BFMatcher.knnMatch for as many pairs, both directions"
_SETTLED = "all done that came before"
_FEATURES = 500
# Keyframes a second while robots come up, and when there are to be more than the station can take.
_COMING_PER_S, _TOO_MANY_PER_S = 12.0, 80.0
_SETTLE_S, _LONG_SETTLE_S = 20.0, 240.0
_WINDOWS, _WINDOW_S, _LONG_WINDOW_S = 3, 4.0, 20.0
_SATURATED_S, _LONG_SATURATED_S = 6.0, 20.0


@dataclass(frozen=True, slots=True)
class Size:
    """What was measured with `robots` robots: windows of a steady load, and one of too much of it.

    Unless the station had `settled` before, what it did in the windows is in part of what came before them.
    """

    robots: int
    settled: bool
    windows: tuple[Window, ...]
    saturated: Window

    @property
    def surveys(self) -> list[float]:
        """Surveys a keyframe, by window, without the sweep, which goes by the second."""
        return [(window.surveys - window.sweeps) / window.keyframes for window in self.windows]

    @property
    def sweeps(self) -> list[float]:
        """Surveys of the sweep a second, by window."""
        return [window.sweeps / window.seconds for window in self.windows]

    @property
    def cpu_ms(self) -> list[float]:
        """Processor time a keyframe without regrouping, by window."""
        return [1e3 * (window.cpu_s - window.regrouping_s) / window.keyframes for window in self.windows]

    @property
    def regrouping_ms(self) -> list[float]:
        """Processor time for regrouping a keyframe, by window."""
        return [1e3 * window.regrouping_s / window.keyframes for window in self.windows]

    def latency_ms(self, share: float) -> list[float]:
        """Latencies that a share of the keyframes does not exceed, by window."""
        return [window.latency_ms(share) for window in self.windows]

    @property
    def turns_ms(self) -> list[float]:
        """How long turns of the loop took."""
        return [turn_ms for window in self.windows for turn_ms in window.turns_ms]


def rows(long: bool) -> Iterator[Row]:
    """Rows `scale/*_nN` of every number of robots N, then the largest against the smallest.

    `surveys` and `cpu` are per keyframe; `regrouping` is processor time per keyframe too, and stated apart since the
    station spaces evaluations out as a swarm grows. `taken` is how many keyframes a second come as far as the groups
    when far more are sent.
    """
    sizes: list[Size] = []
    for robots in LONG_SIZES if long else SIZES:
        sizes.append(measured(robots, long=long))
        yield from _rows(sizes[-1])
    yield from against(sizes[-1], sizes[0])


def measured(robots: int, *, long: bool) -> Size:
    """Load a station with so many robots."""
    with rig(LoadOptions(free_endpoint(), robots=robots, features=_FEATURES)) as running:
        return measure(
            running,
            robots,
            settle_s=_LONG_SETTLE_S if long else _SETTLE_S,
            window_s=_LONG_WINDOW_S if long else _WINDOW_S,
            saturated_s=_LONG_SATURATED_S if long else _SATURATED_S,
        )


def measure(running: Rig, robots: int, *, settle_s: float, window_s: float, saturated_s: float) -> Size:
    """Let robots come up, settle, and send steadily, and then far too much."""
    poses_hz = POSES_PER_S / robots
    sent = running.march(March(_COMING_PER_S / robots, poses_hz, robots / _COMING_PER_S))
    settled = running.settle(settle_s)
    windows: list[Window] = []
    for _ in range(_WINDOWS):
        window, sent = running.window(March(KEYFRAMES_PER_S / robots, poses_hz, window_s), sent)
        windows.append(window)
    saturated, sent = running.window(March(_TOO_MANY_PER_S / robots, poses_hz, saturated_s), sent)
    return Size(robots, settled, tuple(windows), saturated)


def _rows(size: Size) -> Iterator[Row]:
    matched_ms = median(brute_force_ms(load.stock(size.robots, _FEATURES))) * median(size.surveys)
    name = f"n{size.robots}"
    yield replace(_row(f"surveys_{name}", size.surveys, "surveys"), mark=_SETTLED, holds=size.settled)
    yield _row(f"sweeps_{name}", size.sweeps, "surveys/s")
    yield _row(f"cpu_{name}", size.cpu_ms, "ms", peer_median=matched_ms)
    yield _row(f"regrouping_{name}", size.regrouping_ms, "ms")
    yield _row(f"p50_{name}", size.latency_ms(0.5), "ms")
    yield _row(f"p99_{name}", size.latency_ms(0.99), "ms")
    yield _row(f"turn_p99_{name}", [quantile(size.turns_ms, 0.99)], "ms")
    yield _row(f"taken_{name}", [size.saturated.surveyed_per_s], "keyframes/s")


def against(many: Size, few: Size) -> Iterator[Row]:
    """`scale/surveys` and `scale/cpu`: work a keyframe, of many robots to that of few."""
    peer = f"{few.robots} robots, and here {many.robots}"
    surveys, cpu = median(many.surveys) / median(few.surveys), median(many.cpu_ms) / median(few.cpu_ms)
    yield Row(
        bench="scale",
        case="surveys",
        median=surveys,
        spread=None,
        unit="x",
        peer=peer,
        peer_median=1.0,
        mark=f"from {LEAST_SURVEYS:g} to {MOST_SURVEYS:g}",
        holds=LEAST_SURVEYS <= surveys <= MOST_SURVEYS and many.settled and few.settled,
    )
    yield Row(
        bench="scale",
        case="cpu",
        median=cpu,
        spread=None,
        unit="x",
        peer=peer,
        peer_median=1.0,
        mark=f"<= {MOST_CPU:g}",
        holds=cpu <= MOST_CPU and many.settled and few.settled,
    )


def _row(case: str, samples: list[float], unit: str, *, peer_median: float | None = None) -> Row:
    return Row(
        bench="scale",
        case=case,
        median=median(samples),
        spread=spread(samples) if len(samples) > 1 else None,
        unit=unit,
        peer=None if peer_median is None else PEER,
        peer_median=peer_median,
        mark="",
        holds=True,
    )
