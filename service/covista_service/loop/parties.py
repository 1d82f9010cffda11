"""Whom the loop deals with: a source of events, a crew that does the heavy work, and sinks for news."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Protocol

from covista_schemas.reports import EventReport, LiveSettings

from covista_service.perception.camera import Features
from covista_service.perception.comparison import Comparison
from covista_service.perception.scene import Evidence, Settled
from covista_service.station.events import BuildSurfaces, Event, Keyframe, SurveyPair
from covista_service.station.snapshot import Snapshot

# Features of an image and its thumbnail as JPEG; settled keyframes and the evidence with depths.
Extraction = tuple[Features, bytes | None]
Built = tuple[tuple[Settled, ...], Mapping[tuple[int, int], Evidence]]


class Source(Protocol):
    """Where events come from."""

    def attach(self, wake: Callable[[], None]) -> None:
        """Say whom to wake, from any thread, when there are events."""

    def drain(self, limit: int, now_ns: int) -> tuple[Iterable[Event], int | None]:
        """Events of up to `limit` robots, and when there are more, perhaps at once; None: not before it wakes."""


@dataclass(frozen=True, slots=True)
class CrewStatus:
    """How those are who do the heavy work: `capacity` jobs at a time, by `kind` (threads, processes, dask).

    `fallback` says why they work here and not where they should, None if they do; `remark` is what else a person should
    know. Since the start, `lost` workers died or went away, `retried` jobs had to be done again, `overdue` ones did not
    return in time, and `given_up` ones failed for having done so again. `shipped_bytes` of features went to workers;
    `shipped_again` times those that were lost there.
    """

    kind: str
    capacity: int
    warm: bool = True
    fallback: str | None = None
    remark: str | None = None
    lost: int = 0
    retried: int = 0
    overdue: int = 0
    given_up: int = 0
    shipped_bytes: int = 0
    shipped_again: int = 0


class Crew(Protocol):
    """Who does the heavy work."""

    def extract(self, keyframe: Keyframe) -> Future[Extraction]:
        """Decode the keyframe's image and extract its features, and a thumbnail."""

    def survey(self, job: SurveyPair) -> Future[Comparison]:
        """Survey a pair."""

    def build(self, job: BuildSurfaces) -> Future[Built]:
        """Settle poses and surfaces."""

    def status(self) -> CrewStatus:
        """How they are; asked every turn."""


@dataclass(frozen=True, slots=True)
class News:
    """What the world should hear of: what happened, and whether a new revision of the groups stands.

    `robots` are those whose own group is not what they were told last. `settings` are those in force since somebody
    gave others, in a flat `patch` such as {"hysteresis.gain": 0.1}: there may be no event, where they are the same.
    """

    snapshot: Snapshot
    events: tuple[EventReport, ...]
    groups_changed: bool
    robots: tuple[str, ...]
    settings: LiveSettings | None = None
    patch: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SinkStatus:
    """How a sink is doing: entries that wait, and those that were told or lost since the start."""

    waiting: int
    told: int
    lost: int


class Sink(Protocol):
    """Who tells the world; returns at once."""

    def take(self, news: News) -> None:
        """Tell, later and elsewhere."""
