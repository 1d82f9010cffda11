"""Reads the history: pages of it, and what was in force at a moment.

Readers have connections of their own. In SQLite they see what was committed last while the writer goes on.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from covista_schemas.reports import (
    EventKind,
    EventReport,
    EventsHistory,
    Gap,
    GroupsHistory,
    GroupsReport,
    PairHistory,
    PairMoment,
    Report,
    RobotTrack,
    TrackPoint,
)
from pydantic import ValidationError
from sqlalchemy import Connection, Row, func, select

from covista_service.answers.past import PAGE, HistoryUnavailableError, Moment
from covista_service.store.database import UNUSABLE, file_is_gone, first_line, open_engine
from covista_service.store.moments import moment, not_after_us
from covista_service.store.pages import Page, Span, gaps_within, page_of, page_of_kinds, page_of_robot
from covista_service.store.tables import POSE, events, group_revisions, pair_overlaps, tracks
from covista_service.store.whereabouts import Reach, overlaps_at, points_at
from covista_service.telemetry import about

log = logging.getLogger(__name__)
_R = TypeVar("_R", bound=Report)
_T = TypeVar("_T")


class Archive:
    """`answers.past.Archive` of a database; for any number of threads, of which some fifteen read at a time."""

    def __init__(self, url: str) -> None:
        """Nothing is opened before somebody asks. Raises DatabaseError for a URL that no engine can be made of."""
        self._engine = open_engine(url, reads=True)

    def close(self) -> None:
        """Let go of connections."""
        self._engine.dispose()

    def groups(
        self, since_ns: int | None = None, until_ns: int | None = None, cursor: str | None = None, limit: int = PAGE
    ) -> GroupsHistory:
        """Revisions of the groups."""
        span = Span.of(since_ns, until_ns, cursor)
        with self._reading() as connection:
            page = page_of(connection, group_revisions, span, limit, ("report",))
            items = _reports(GroupsReport, page.rows)
            return GroupsHistory(items=items, next=page.next, gaps=_gaps(connection, page))

    def groups_at(self, time_ns: int) -> GroupsReport | None:
        """The revision that was in force then; None if none was, or it is not kept any more."""
        with self._reading() as connection:
            return _groups_at(connection, time_ns)

    def moment(self, time_ns: int, reach_s: float) -> Moment:
        """The swarm then; what was told more than `reach_s` before says nothing of it, but for the groups."""
        reach = Reach.of(time_ns, round(reach_s * 1e9))
        with self._reading() as connection:
            points = _readable(lambda row: (row.robot, _point(row[:-1])), points_at(connection, reach))
            return Moment(
                groups=_groups_at(connection, time_ns),
                points=dict(points),
                overlaps={
                    (row.a, row.b): (row.overlap_a or 0.0, row.overlap_b or 0.0)
                    for row in overlaps_at(connection, reach)
                },
            )

    def events(
        self,
        since_ns: int | None = None,
        until_ns: int | None = None,
        cursor: str | None = None,
        limit: int = PAGE,
        kinds: Sequence[EventKind] = (),
        robot: str | None = None,
    ) -> EventsHistory:
        """Events; a page of one robot's may hold fewer than `limit` and still not be the last."""
        span, names = Span.of(since_ns, until_ns, cursor), sorted({kind.value for kind in kinds})
        with self._reading() as connection:
            if robot is not None:
                page = page_of_robot(connection, robot, names, span, limit)
            elif names:
                page = page_of_kinds(connection, names, span, limit)
            else:
                page = page_of(connection, events, span, limit, ("report",))
            items = [each for each in _reports(EventReport, page.rows) if robot is None or robot in each.robots]
            return EventsHistory(items=items, next=page.next, gaps=_gaps(connection, page))

    def events_after(self, number: int, limit: int = PAGE) -> list[EventReport]:
        """The next events after this number, in the order of numbers."""
        table = events.c
        following = select(table.report).where(table.number > min(max(number, -1), 2**62))
        with self._reading() as connection:
            rows = connection.execute(following.order_by(table.number, table.id).limit(limit)).all()
        return _reports(EventReport, rows)

    def oldest_event(self) -> int | None:
        """The number of the oldest event that is kept; None if there is none."""
        with self._reading() as connection:
            return connection.execute(select(func.min(events.c.number))).scalar()

    def pair(
        self,
        a: str,
        b: str,
        since_ns: int | None = None,
        until_ns: int | None = None,
        cursor: str | None = None,
        limit: int = PAGE,
    ) -> PairHistory:
        """The overlap of a pair over time, in the order asked for."""
        table, span = pair_overlaps.c, Span.of(since_ns, until_ns, cursor)
        first, second, sides = (a, b, ("overlap_a", "overlap_b")) if a < b else (b, a, ("overlap_b", "overlap_a"))
        with self._reading() as connection:
            which = (table.a == first) & (table.b == second)
            page = page_of(connection, pair_overlaps, span, limit, (*sides, "found_by"), which)
            items = _readable(_moment, page.rows)
            return PairHistory(a=a, b=b, items=items, next=page.next, gaps=_gaps(connection, page))

    def track(
        self,
        robot: str,
        since_ns: int | None = None,
        until_ns: int | None = None,
        cursor: str | None = None,
        limit: int = PAGE,
    ) -> RobotTrack:
        """Where a robot was."""
        span = Span.of(since_ns, until_ns, cursor)
        with self._reading() as connection:
            page = page_of(connection, tracks, span, limit, POSE, tracks.c.robot == robot)
            items = _readable(_point, page.rows)
            return RobotTrack(robot=robot, items=items, next=page.next, gaps=_gaps(connection, page))

    @contextmanager
    def _reading(self) -> Iterator[Connection]:
        if file_is_gone(self._engine):
            raise HistoryUnavailableError("the history cannot be read: its file is gone")
        try:
            with self._engine.begin() as connection:
                yield connection
        except UNUSABLE as error:
            raise HistoryUnavailableError(f"the history cannot be read: {first_line(error)}") from error


def _groups_at(connection: Connection, time_ns: int) -> GroupsReport | None:
    table = group_revisions.c
    newest = select(table.report).where(table.time_us <= not_after_us(time_ns))
    rows = connection.execute(newest.order_by(table.time_us.desc(), table.id.desc()).limit(1)).all()
    return next(iter(_reports(GroupsReport, rows)), None)


def _reports(kind: type[_R], rows: Sequence[Row[Any]]) -> list[_R]:
    return _readable(lambda row: kind.read(row.report), rows)


def _readable(read: Callable[[Row[Any]], _T], rows: Sequence[Row[Any]]) -> list[_T]:
    """What can be read of the rows: one that cannot must not take the others with it."""
    said: list[_T] = []
    for row in rows:
        try:
            said.append(read(row))
        except ValidationError as error:
            log.warning("an entry of the history cannot be read", extra=about(said=error.title))
    return said


def _moment(row: Row[Any]) -> PairMoment:
    """Of a row whose first two columns behind time and key are the overlaps in the order asked for."""
    time_us, _, first, second, found_by = tuple(row)
    return PairMoment(time=moment(time_us), overlap_a=first, overlap_b=second, found_by=found_by)


def _point(row: Sequence[Any]) -> TrackPoint:
    time_us, _, x, y, z, *orientation = tuple(row)
    return TrackPoint.model_validate(
        {"time": moment(time_us), "position_m": (x, y, z), "orientation_xyzw": tuple(orientation)}
    )


def _gaps(connection: Connection, page: Page) -> list[Gap]:
    return _readable(
        lambda row: Gap(since=moment(row.since_us), until=moment(row.until_us), lost=row.lost, reason=row.reason),
        gaps_within(connection, page),
    )
