"""The station at one moment, from all who know something of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from covista_schemas.reports import Health

from covista_service.loop.vitals import Vitals
from covista_service.station.census import Census
from covista_service.station.snapshot import RobotView
from covista_service.telemetry import Summary


@dataclass(frozen=True, slots=True)
class Timings:
    """What was measured since the start: latencies of keyframes, seconds that turns of the loop took, and memory."""

    latency_sum_s: float = 0.0
    latencies: int = 0
    within_half_s: int = 0
    turns_s: float = 0.0
    memory_bytes: float | None = None
    faults: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Checkup:
    """The station at one moment, from all who know something of it.

    `refused` counts requests that were not let in, `given_up` answers that were not sent, both by reason; `listeners`
    hear events over REST; of `most_pages` there are `pages` open.
    """

    health: Health
    vitals: Vitals
    census: Census
    robots: Sequence[RobotView]
    summary: Summary
    timings: Timings
    refused: Mapping[str, int]
    given_up: Mapping[str, int]
    listeners: int
    pages: int
    most_pages: int
