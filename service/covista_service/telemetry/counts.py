"""What the loop counts and times, for Prometheus and for the demo's report."""

from __future__ import annotations

import time
from array import array
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

from prometheus_client import CollectorRegistry, Gauge, GCCollector, Histogram, PlatformCollector, ProcessCollector
from prometheus_client import Counter as PrometheusCounter

JobKind = Literal["extract", "compare", "build"]
# What the loop does in its own thread: a whole turn; in it, reading overlaps from new surfaces, and what a Tick does.
Stage = Literal["turn", "reading", "regroup"]

WORKER_FAILED = "worker_failed"
_JOBS: tuple[JobKind, ...] = ("extract", "compare", "build")
_SAMPLES = 100_000
_LATENCIES_S = (0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
_JOBS_S = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0)
_STAGES_S = (0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5)
_REQUESTS_S = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0)


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
    """Counts of one station; written by the loop, read by anybody. `timer` gives seconds since any moment."""

    def __init__(self, timer: Callable[[], float] = time.perf_counter) -> None:
        # Compiled maths comes with it, which who only logs has no use for.
        from covista_service.perception.comparison import Outcome

        self.registry = CollectorRegistry()
        self.timer = timer
        self._received: Counter[str] = Counter()
        self._outcomes: Counter[str] = Counter()
        # The newest ones in a ring that is all there from the beginning: a station must not grow by measuring itself.
        self._latencies_s = array("d", [0.0]) * _SAMPLES
        self._grouped = 0
        self._under_way: Counter[str] = Counter()
        self._asked = 0
        self._surveys = self._count("covista_surveys", "Surveys by what they came to.", "outcome")
        self._faults = self._count("covista_faults", "Errors of the station itself, by where.", "where")
        self._jobs = Gauge(
            "covista_jobs_under_way", "Jobs at the workers, waiting ones included.", ["kind"], registry=self.registry
        )
        self._job_s = self._time(
            "covista_job_seconds", "From handing a job to the workers to its end, waiting included.", _JOBS_S, "kind"
        )
        self._work_s = self._time(
            "covista_work_seconds", "How long a job took where it was done, without waiting.", _JOBS_S, "kind"
        )
        # What has not happened yet is 0 and not absent, so that its first time shows as an increase.
        for outcome in (*Outcome, WORKER_FAILED):
            self._surveys.labels(str(outcome))
        for where in ("loop", "sink", "station"):
            self._faults.labels(where)
        for kind in _JOBS:
            self._jobs.labels(kind)
            self._job_s.labels(kind)
            self._work_s.labels(kind)
        self._latency = self._time(
            "covista_keyframe_to_groups_seconds",
            "From a keyframe's arrival to the first groups evaluated with a survey of it.",
            _LATENCIES_S,
        )
        self._stages: dict[Stage, Histogram] = {
            "turn": self._time("covista_turn_seconds", "A turn of the loop.", _STAGES_S),
            "reading": self._time("covista_reading_seconds", "Reading overlaps from new surfaces.", _STAGES_S),
            "regroup": self._time("covista_regroup_seconds", "Presence, agenda and groups after a burst.", _STAGES_S),
        }
        self._requests = self._time("covista_request_seconds", "Requests to REST, by route.", _REQUESTS_S, "route")
        self._answers = self._count("covista_requests", "Requests to REST, by route and status.", "route", "status")
        for collector in (ProcessCollector, PlatformCollector, GCCollector):
            collector(registry=self.registry)

    def received(self, topic: str, count: int) -> None:
        """Messages arrived."""
        self._received[topic] += count

    def started(self, kind: JobKind) -> None:
        """A job went to the workers."""
        self._under_way[kind] += 1
        self._jobs.labels(kind).set(self._under_way[kind])

    def worked(self, kind: JobKind, seconds: float) -> None:
        """A job is over, so long after it was handed over; from any thread."""
        self._job_s.labels(kind).observe(max(0.0, seconds))

    def took(self, kind: JobKind, seconds: float) -> None:
        """A job took so long where it was done; from any thread."""
        self._work_s.labels(kind).observe(seconds)

    def ended(self, kind: JobKind) -> None:
        """What became of a job is taken in."""
        self._under_way[kind] -= 1
        self._jobs.labels(kind).set(self._under_way[kind])

    def surveyed(self, outcome: str) -> None:
        """A pair was surveyed."""
        self._outcomes[outcome] += 1
        self._surveys.labels(outcome).inc()

    def grouped(self, latency_s: float) -> None:
        """A keyframe shows in the groups, so long after it arrived."""
        self._latencies_s[self._grouped % _SAMPLES] = latency_s
        self._grouped += 1
        self._latency.observe(max(0.0, latency_s))

    @contextmanager
    def timed(self, stage: Stage) -> Iterator[None]:
        """Time what the loop does."""
        begun_s = self.timer()
        try:
            yield
        finally:
            self._stages[stage].observe(self.timer() - begun_s)

    def is_asked(self) -> bool:
        """Does anybody wait for REST to answer?"""
        return self._asked > 0

    def asked(self) -> None:
        """REST was asked, and will have `answered`."""
        self._asked += 1

    def answered(self, route: str, status: int, seconds: float) -> None:
        """REST has answered; `route` is the template of the path, so that there are few of them."""
        self._asked -= 1
        self._requests.labels(route).observe(seconds)
        self._answers.labels(route, str(status)).inc()

    def fault(self, where: str) -> None:
        """Something of our own went wrong, and was survived."""
        self._faults.labels(where).inc()

    def summary(self) -> Summary:
        """How it went so far."""
        latencies_s = sorted(self._latencies_s[: self._grouped])
        return Summary(
            surveys=self._outcomes.total(),
            under_way=self._under_way.total(),
            latency_p50_ms=_quantile_ms(latencies_s, 0.5),
            latency_p99_ms=_quantile_ms(latencies_s, 0.99),
            keyframes_received=self._received["keyframe"],
            poses_received=self._received["pose"],
            outcomes=dict(self._outcomes),
        )

    def _count(self, name: str, words: str, *labels: str) -> PrometheusCounter:
        return PrometheusCounter(name, words, labels, registry=self.registry)

    def _time(self, name: str, words: str, buckets_s: tuple[float, ...], *labels: str) -> Histogram:
        return Histogram(name, words, labels, buckets=buckets_s, registry=self.registry)


def _quantile_ms(ordered_s: list[float], share: float) -> float | None:
    """The smallest value that `share` of all do not exceed."""
    if not ordered_s:
        return None
    return 1e3 * ordered_s[min(len(ordered_s) - 1, int(share * len(ordered_s)))]
