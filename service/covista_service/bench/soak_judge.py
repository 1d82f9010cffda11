"""What must not grow in a soak, and by how much it may."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from covista_service.bench.row import Row
from covista_service.bench.soak_station import Look, quantile_s
from covista_service.bench.trend import Series, Trend, Verdict, trend_of

# Shorter than that, nothing can be said of what grows.
LEAST_MIN = 20.0
# In half an hour a block is a minute: long beside what comes and goes by itself, so that one says little of the next.
BLOCKS = 24
# Latencies are of so many seconds each: some hundreds of keyframes.
WINDOW_S = 60.0
# With fewer looks than that there is no trend.
_LEAST_LOOKS = 10
_UNKNOWN = Trend(0.0, math.inf, 1.0, 0.0)


@dataclass(frozen=True, slots=True)
class Limit:
    """Growth in all that is none to speak of: so much, or such a share of what was there."""

    unit: str
    most: float
    is_share: bool = False

    def bound(self, level: float) -> float:
        """In the unit."""
        return self.most * level if self.is_share else self.most

    def __str__(self) -> str:
        return f"<= {100 * self.most:g} % in all" if self.is_share else f"<= {self.most:g} {self.unit} in all"


# Files and threads are whole: one that is left behind in half an hour is a leak. The write-ahead log is 4 MB, and
# begins anew. What few keyframes exceed in a minute varies more than what half of them do.
LIMITS = {
    "resident": Limit("MB", 0.01, is_share=True),
    "files": Limit("files", 1),
    "threads": Limit("threads", 1),
    "wal": Limit("MB", 0.5),
    "p50": Limit("ms", 0.1, is_share=True),
    "p99": Limit("ms", 0.25, is_share=True),
}


@dataclass(frozen=True, slots=True)
class Seen:
    """One thing over time, (s, value), and how many were there at each of these that may explain it."""

    points: Series
    beside: Sequence[float]


@dataclass(frozen=True, slots=True)
class Judged:
    """A thing, its trend, and what that says."""

    name: str
    trend: Trend
    limit: Limit

    @property
    def verdict(self) -> Verdict:
        """Against its limit."""
        return self.trend.verdict(self.limit.bound(self.trend.level))

    def row(self) -> Row:
        """As a row; what cannot be said does not hold."""
        return Row(
            bench="soak",
            case=self.name,
            median=self.trend.grown,
            spread=self.trend.unsure if math.isfinite(self.trend.unsure) else None,
            unit=self.limit.unit,
            peer=None,
            peer_median=None,
            mark=f"{self.limit}, for sure: {self.verdict}",
            holds=self.verdict == "flat",
        )


def judged(seen: dict[str, Seen]) -> Iterator[Judged]:
    """All that has a limit; what was not seen often enough for a trend too."""
    for name, limit in LIMITS.items():
        points, beside = seen[name].points, seen[name].beside
        yield Judged(name, trend_of(points, beside, BLOCKS) if len(points) >= _LEAST_LOOKS else _UNKNOWN, limit)


def seen_in(looks: Sequence[Look]) -> dict[str, Seen]:
    """What must not grow, by name. Memory goes with robots known, all else with sessions."""
    begun_s = looks[0].at_s
    sessions = [float(look.sessions) for look in looks]
    values: dict[str, Callable[[Look], float]] = {
        "files": lambda look: look.files,
        "threads": lambda look: look.threads,
        "wal": lambda look: look.wal_mb,
    }
    seen = {
        name: Seen([(look.at_s - begun_s, value(look)) for look in looks], sessions) for name, value in values.items()
    }
    resident = [(look.at_s - begun_s, look.resident_mb) for look in looks]
    seen["resident"] = Seen(resident, [float(look.robots) for look in looks])
    for share in (0.5, 0.99):
        seen[f"p{share * 100:g}"] = _latencies(looks, share)
    return seen


def _latencies(looks: Sequence[Look], share: float) -> Seen:
    points, beside, before = list[tuple[float, float]](), list[float](), looks[0]
    for look in looks[1:]:
        if look.at_s - before.at_s >= WINDOW_S:
            value_s = quantile_s(before, look, share)
            if value_s is not None:
                points.append(((before.at_s + look.at_s) / 2 - looks[0].at_s, 1e3 * value_s))
                beside.append((before.sessions + look.sessions) / 2)
            before = look
    return Seen(points, beside)
