"""A row of the benchmarks: one figure, what it is held against, and how it was taken."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Row:
    """`median` and interquartile `spread` of a figure; `peer` names what else was measured in the same run.

    There is no spread of a figure that is taken once.
    """

    bench: str
    case: str
    median: float
    spread: float | None
    unit: str
    peer: str | None
    peer_median: float | None
    mark: str
    holds: bool

    def as_json(self) -> dict[str, object]:
        """What `covista-station bench --format json` writes of it."""
        return asdict(self)


def median(samples: Sequence[float]) -> float:
    """Median of samples."""
    return float(np.median(samples))


def spread(samples: Sequence[float]) -> float:
    """Distance between the quartiles of samples."""
    low, high = np.percentile(samples, (25, 75))
    return float(high - low)


def quantile(samples: Sequence[float], share: float) -> float:
    """What a share of samples does not exceed."""
    return float(np.quantile(samples, share))


def timed(
    bench: str,
    case: str,
    times_ms: Sequence[float],
    mark: str,
    *,
    holds: bool,
    peer: str,
    peer_ms: Sequence[float] | None,
) -> Row:
    """A row of times; `peer` stands in it if its times are there."""
    return Row(
        bench=bench,
        case=case,
        median=median(times_ms),
        spread=spread(times_ms),
        unit="ms",
        peer=None if peer_ms is None else peer,
        peer_median=None if peer_ms is None else median(peer_ms),
        mark=mark,
        holds=holds,
    )


def alternately_ms(calls: Sequence[Callable[[], object]], rounds: int) -> list[list[float]]:
    """Times of each call, ms. They take turns, so that whatever else the machine does touches all alike.

    The first round is not counted: it compiles and warms caches.
    """
    times: list[list[float]] = [[] for _ in calls]
    for round_index in range(rounds + 1):
        for call, taken in zip(calls, times, strict=True):
            start = time.perf_counter_ns()
            call()
            if round_index:
                taken.append((time.perf_counter_ns() - start) / 1e6)
    return times
