"""What can be asked of the past, whoever keeps it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from covista_schemas.errors import CovistaError
from covista_schemas.reports import (
    EventKind,
    EventReport,
    EventsHistory,
    GroupsHistory,
    GroupsReport,
    PairHistory,
    RobotTrack,
    TrackPoint,
)

from covista_service.station.events import Pair

PAGE = 100


class CursorError(CovistaError, ValueError):
    """A cursor that no page of the history has given."""


class HistoryUnavailableError(CovistaError):
    """The history cannot be read now; the text says why."""


@dataclass(frozen=True, slots=True)
class Moment:
    """The swarm at one moment of the past, as far as it was known then.

    `groups` is the revision in force, None if none was or is kept; `points` where robots were; `overlaps` of pairs
    a < b that had anything in common, the share of a's image that b saw and of b's that a did.
    """

    groups: GroupsReport | None
    points: Mapping[str, TrackPoint]
    overlaps: Mapping[Pair, tuple[float, float]]


class Archive(Protocol):
    """Reads the history, from any thread; a call may take as long as its database, but seconds at most.

    Pages are of since <= time < until (ns of the wall; None: no bound), the oldest first, of at most `limit` items. All
    raise HistoryUnavailableError, and CursorError for a cursor that is none.
    """

    def groups(
        self, since_ns: int | None = None, until_ns: int | None = None, cursor: str | None = None, limit: int = PAGE
    ) -> GroupsHistory:
        """Revisions of the groups."""

    def groups_at(self, time_ns: int) -> GroupsReport | None:
        """The revision that was in force then; None if none was, or it is not kept any more."""

    def moment(self, time_ns: int, reach_s: float) -> Moment:
        """The swarm then. What was told more than `reach_s` before says nothing of it, but for the groups."""

    def events(
        self,
        since_ns: int | None = None,
        until_ns: int | None = None,
        cursor: str | None = None,
        limit: int = PAGE,
        kinds: Sequence[EventKind] = (),
        robot: str | None = None,
    ) -> EventsHistory:
        """Events, of these kinds alone where there are any, and those that name a robot.

        A page of one robot's events may hold fewer than `limit` and still not be the last.
        """

    def events_after(self, number: int, limit: int = PAGE) -> list[EventReport]:
        """The next events after this number, in the order of numbers."""

    def oldest_event(self) -> int | None:
        """The number of the oldest event that is kept; None if there is none."""

    def pair(
        self,
        a: str,
        b: str,
        since_ns: int | None = None,
        until_ns: int | None = None,
        cursor: str | None = None,
        limit: int = PAGE,
    ) -> PairHistory:
        """The overlap of a pair over time, in the order asked for; empty for a pair that nothing is kept of."""

    def track(
        self,
        robot: str,
        since_ns: int | None = None,
        until_ns: int | None = None,
        cursor: str | None = None,
        limit: int = PAGE,
    ) -> RobotTrack:
        """Where a robot was; empty for one that nothing is kept of."""
