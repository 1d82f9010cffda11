"""How long from a keyframe's arrival to the first groups that contain a survey of it, under a steady load?

Twenty robots send one keyframe of 500 features and one pose a second, from a process on the same machine.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from covista_clients.simulation.marching import March

from covista_service.bench import load
from covista_service.bench.brute_force import brute_force_ms
from covista_service.bench.load import LoadOptions, Sent
from covista_service.bench.rig import LoadError, Window, free_endpoint, rig
from covista_service.bench.row import Row, median, spread

__all__ = ["LoadError", "free_endpoint", "rows", "under_load"]

MARKS_MS = {"p50": (0.5, 100.0), "p99": (0.99, 500.0)}
PEER = "OpenCV BFMatcher.knnMatch of one pair, both directions"
_SECONDS, _LONG_SECONDS = 20.0, 120.0
_RATE_HZ = 1.0
_PARTS = 4


def rows(long: bool) -> Iterator[Row]:
    """`latency/p50` and `latency/p99`; they hold only if every keyframe is accounted for.

    The spread is that of quarters of the time. One pair of descriptors matched is the least that could be waited for.
    """
    options = LoadOptions(free_endpoint())
    seconds = (_LONG_SECONDS if long else _SECONDS) / _PARTS
    windows, all_counted = under_load(options, March(_RATE_HZ, _RATE_HZ, seconds))
    matched_ms = median(brute_force_ms(load.stock(options.robots, options.features)))
    whole = replace(windows[0], latencies_ms=tuple(each for window in windows for each in window.latencies_ms))
    for case, (share, mark_ms) in MARKS_MS.items():
        figure = whole.latency_ms(share)
        yield Row(
            bench="latency",
            case=case,
            median=figure,
            spread=spread([window.latency_ms(share) for window in windows]),
            unit="ms",
            peer=PEER,
            peer_median=matched_ms,
            mark=f"<= {mark_ms:g} ms, nothing lost uncounted",
            holds=figure <= mark_ms and all_counted,
        )


def under_load(options: LoadOptions, quarter: March) -> tuple[list[Window], bool]:
    """What a station did under a load, by quarters of the time; and was every keyframe sent received or missed?"""
    windows: list[Window] = []
    sent = Sent(0, 0, 0.0)
    with rig(options) as running:
        for _ in range(_PARTS):
            window, sent = running.window(quarter, sent)
            windows.append(window)
        running.settle()
        # Those of the last moment.
        late = tuple(latency_ms for _, latency_ms in running.readings().latencies_ms)
        windows[-1] = replace(windows[-1], latencies_ms=windows[-1].latencies_ms + late)
        return windows, running.accounted(sent)
