"""Pages of the history's tables: from a place on, in the order of time, with the place where the next one begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

from sqlalchemy import ColumnElement, Connection, Row, Select, Table, and_, or_, select, true

from covista_service.store.cursors import Place, cursor_of, place_of
from covista_service.store.moments import EARLIEST_US, LATEST_US, not_before_us
from covista_service.store.tables import events, gaps

# So many events are looked through for those of one robot at a time; who wants more asks for the next page.
LOOK = 5000
_MOST_GAPS = 100


@dataclass(frozen=True, slots=True)
class Span:
    """since_us <= time < until_us, and behind the place `after`."""

    since_us: int
    until_us: int
    after: Place | None = None

    @classmethod
    def of(cls, since_ns: int | None, until_ns: int | None, cursor: str | None) -> Self:
        """From ns, None for no bound. Raises CursorError."""
        since_us = EARLIEST_US if since_ns is None else not_before_us(since_ns)
        until_us = LATEST_US if until_ns is None else not_before_us(until_ns)
        return cls(since_us, until_us, None if cursor is None else place_of(cursor))

    @property
    def begin_us(self) -> int:
        """The first moment that the page is of."""
        return self.since_us if self.after is None else max(self.since_us, self.after[0])

    def of_table(self, table: Table) -> ColumnElement[bool]:
        """Which rows lie in it."""
        time_us, key = table.c.time_us, table.c.id
        bounds = and_(time_us >= self.begin_us, time_us < self.until_us)
        if self.after is None:
            return bounds
        after_us, after_key = self.after
        return and_(bounds, or_(time_us > after_us, key > after_key))


@dataclass(frozen=True, slots=True)
class Page:
    """Rows, the cursor of the next page, and the time begin_us <= t <= end_us that this one is of."""

    rows: Sequence[Row[Any]]
    next: str | None
    begin_us: int
    end_us: int


def page_of(
    connection: Connection,
    table: Table,
    span: Span,
    limit: int,
    columns: Sequence[str],
    which: ColumnElement[bool] | None = None,
) -> Page:
    """A page of a table: rows of time, key and these columns."""
    wanted = _rows(table, columns).where(true() if which is None else which, span.of_table(table))
    return _page(connection.execute(_in_order(wanted, table).limit(limit + 1)).all(), span, limit)


def page_of_kinds(connection: Connection, kinds: Sequence[str], span: Span, limit: int) -> Page:
    """A page of events of some kinds: of each as many as it may need, for a kind's come fast by its index."""
    wanted = _rows(events, ("report",)).where(span.of_table(events))
    rows: list[Row[Any]] = []
    for kind in kinds:
        rows += connection.execute(_in_order(wanted.where(events.c.kind == kind), events).limit(limit + 1))
    return _page(sorted(rows, key=lambda row: (row.time_us, row.id))[: limit + 1], span, limit)


def page_of_robot(connection: Connection, robot: str, kinds: Sequence[str], span: Span, limit: int) -> Page:
    """A page of the events that name a robot, among the next `LOOK`."""
    places = _in_order(_rows(events, ()).where(span.of_table(events)), events)
    last = connection.execute(places.offset(LOOK - 1).limit(1)).first()
    if last is not None:
        # Of that very microsecond there may be more: they are looked through too.
        span = Span(span.since_us, min(span.until_us, last.time_us + 1), span.after)
    wanted = _rows(events, ("report",)).where(span.of_table(events), events.c.report.contains(f'"{robot}"'))
    if kinds:
        wanted = wanted.where(events.c.kind.in_(kinds))
    page = _page(connection.execute(_in_order(wanted, events).limit(limit + 1)).all(), span, limit)
    if page.next is not None or last is None:
        return page
    return Page(page.rows, cursor_of((last.time_us, _LAST_KEY)), page.begin_us, last.time_us)


def gaps_within(connection: Connection, page: Page) -> Sequence[Row[Any]]:
    """The gaps that overlap a page, in the order of time."""
    overlap = and_(gaps.c.until_us >= page.begin_us, gaps.c.since_us <= page.end_us)
    return connection.execute(select(gaps).where(overlap).order_by(gaps.c.since_us, gaps.c.id).limit(_MOST_GAPS)).all()


# Behind every key.
_LAST_KEY = 2**62


def _rows(table: Table, columns: Sequence[str]) -> Select[Any]:
    return select(table.c.time_us, table.c.id, *(table.c[name] for name in columns))


def _in_order(rows: Select[Any], table: Table) -> Select[Any]:
    return rows.order_by(table.c.time_us, table.c.id)


def _page(rows: Sequence[Row[Any]], span: Span, limit: int) -> Page:
    """Of `limit` rows and one more, if there is one."""
    if len(rows) <= limit:
        return Page(rows, None, span.begin_us, span.until_us - 1)
    last = rows[limit - 1]
    return Page(rows[:limit], cursor_of((last.time_us, last.id)), span.begin_us, last.time_us)
