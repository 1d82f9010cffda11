"""How the station is doing: logging, counts, and how long a keyframe takes to show in the groups."""

from __future__ import annotations

import logging
import sys
from collections import Counter, deque
from dataclasses import dataclass

from prometheus_client import CollectorRegistry, Gauge, Histogram
from prometheus_client import Counter as PrometheusCounter

_SAMPLES = 100_000
_LATENCIES_S = (0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0)


def log_to_stderr(level: str) -> None:
    """Send the log of this process to stderr, from `level` on (debug, info, warning, error)."""
    logging.basicConfig(
        level=level.upper(), stream=sys.stderr, format="%(asctime)s %(levelname)-7s %(name)s: %(message)s", force=True
    )
    # Each request of a dashboard is not news.
    logging.getLogger("uvicorn.access").setLevel(logging.WARNING)


@dataclass(frozen=True, slots=True)
class Summary:
    """What the station has measured of itself since it started.

    `under_way` counts surveys, surfaces and extractions at the workers; latencies run from a keyframe's arrival to the
    first groups evaluated with a survey of it.
    """

    surveys: int
    under_way: int
    latency_p50_ms: float | None
    latency_p99_ms: float | None
    keyframes_received: int
    poses_received: int
    outcomes: dict[str, int]


class Telemetry:
    """Counts of one station; written by the loop, read by anybody."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self._received: Counter[str] = Counter()
        self._outcomes: Counter[str] = Counter()
        self._latencies_s: deque[float] = deque(maxlen=_SAMPLES)
        self._under_way = 0
        self._surveys = PrometheusCounter(
            "covista_surveys", "Surveys by what they came to.", ["outcome"], registry=self.registry
        )
        self._jobs = Gauge(
            "covista_jobs_under_way", "Surveys, surfaces and extractions at the workers.", registry=self.registry
        )
        self._latency = Histogram(
            "covista_keyframe_to_groups_seconds",
            "From a keyframe's arrival to the first groups evaluated with a survey of it.",
            buckets=_LATENCIES_S,
            registry=self.registry,
        )
        self._faults = PrometheusCounter(
            "covista_faults", "Errors of the station itself, by where.", ["where"], registry=self.registry
        )

    def received(self, topic: str, count: int) -> None:
        """Messages arrived."""
        self._received[topic] += count

    def started(self) -> None:
        """A job went to the workers."""
        self._under_way += 1
        self._jobs.set(self._under_way)

    def ended(self) -> None:
        """A job came back, however."""
        self._under_way -= 1
        self._jobs.set(self._under_way)

    def surveyed(self, outcome: str) -> None:
        """A pair was surveyed."""
        self._outcomes[outcome] += 1
        self._surveys.labels(outcome).inc()

    def grouped(self, latency_s: float) -> None:
        """A keyframe shows in the groups, so long after it arrived."""
        self._latencies_s.append(latency_s)
        self._latency.observe(max(0.0, latency_s))

    def fault(self, where: str) -> None:
        """Something of our own went wrong, and was survived."""
        self._faults.labels(where).inc()

    def summary(self) -> Summary:
        """How it went so far."""
        latencies_s = sorted(self._latencies_s.copy())
        return Summary(
            surveys=self._outcomes.total(),
            under_way=self._under_way,
            latency_p50_ms=_quantile_ms(latencies_s, 0.5),
            latency_p99_ms=_quantile_ms(latencies_s, 0.99),
            keyframes_received=self._received["keyframe"],
            poses_received=self._received["pose"],
            outcomes=dict(self._outcomes),
        )


def _quantile_ms(ordered_s: list[float], share: float) -> float | None:
    """The smallest value that `share` of all do not exceed."""
    if not ordered_s:
        return None
    return 1e3 * ordered_s[min(len(ordered_s) - 1, int(share * len(ordered_s)))]
