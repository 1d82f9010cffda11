"""What was known last at one moment: of each robot where it was, of each pair what its views had in common.

Tables hold a row for each change, of which a moment needs the last one of each robot and pair. Names come by leaps
through the index (from one to the next, over all rows between), rows by its end: so it costs by robots and pairs, and
not by the millions of rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import CTE, ColumnElement, Connection, Row, Select, Table, and_, func, or_, select

from covista_service.store.moments import not_after_us, within
from covista_service.store.tables import POSE, pair_overlaps, tracks

# Parameters of one statement; every SQLite takes so many.
_AT_ONCE = 900


@dataclass(frozen=True, slots=True)
class Reach:
    """since_us <= time <= until_us: what is older says nothing of the moment `until_us`."""

    since_us: int
    until_us: int

    @classmethod
    def of(cls, time_ns: int, reach_ns: int) -> Reach:
        """So far back from a moment."""
        until_us = not_after_us(time_ns)
        return cls(within(until_us - reach_ns // 1000), until_us)

    def last(self, table: Table, which: ColumnElement[bool]) -> Select[Any]:
        """The key of the last row in it, of those."""
        rows = select(table.c.id).where(which, table.c.time_us.between(self.since_us, self.until_us))
        return rows.order_by(table.c.time_us.desc(), table.c.id.desc()).limit(1)


def points_at(connection: Connection, reach: Reach) -> list[Row[Any]]:
    """Time, key, pose and robot: the last of each robot."""
    robots = _robots()
    last = reach.last(tracks, tracks.c.robot == robots.c.robot).scalar_subquery()
    keys = [key for (key,) in connection.execute(select(last).select_from(robots)) if key is not None]
    return list(_rows(connection, tracks, (*POSE, "robot"), keys))


def overlaps_at(connection: Connection, reach: Reach) -> list[Row[Any]]:
    """Time, key, the pair and its overlaps: the last of each pair that had anything in common then."""
    pairs = _pairs()
    which = and_(pair_overlaps.c.a == pairs.c.a, pair_overlaps.c.b == pairs.c.b)
    last = reach.last(pair_overlaps, which).scalar_subquery()
    keys = select(last).select_from(pairs).where(pairs.c.b.is_not(None))
    found = [key for (key,) in connection.execute(keys) if key is not None]
    common = or_(pair_overlaps.c.overlap_a > 0, pair_overlaps.c.overlap_b > 0)
    return list(_rows(connection, pair_overlaps, ("a", "b", "overlap_a", "overlap_b"), found, common))


def _robots() -> CTE:
    """All robots that there are tracks of."""
    first = select(func.min(tracks.c.robot).label("robot")).cte("robots", recursive=True)
    later = select(func.min(tracks.c.robot)).where(tracks.c.robot > first.c.robot).scalar_subquery()
    return first.union_all(select(later).select_from(first).where(first.c.robot.is_not(None)))


def _pairs() -> CTE:
    """All pairs that there are overlaps of; where no b is left, the row has none."""
    table = pair_overlaps.c
    firsts = select(func.min(table.a).label("a")).cte("firsts", recursive=True)
    later = select(func.min(table.a)).where(table.a > firsts.c.a).scalar_subquery()
    firsts = firsts.union_all(select(later).select_from(firsts).where(firsts.c.a.is_not(None)))
    least = select(func.min(table.b)).where(table.a == firsts.c.a).scalar_subquery()
    pairs = select(firsts.c.a, least.label("b")).where(firsts.c.a.is_not(None)).cte("pairs", recursive=True)
    following = select(func.min(table.b)).where(table.a == pairs.c.a, table.b > pairs.c.b).scalar_subquery()
    return pairs.union_all(select(pairs.c.a, following).where(pairs.c.b.is_not(None)))


def _rows(
    connection: Connection,
    table: Table,
    columns: Sequence[str],
    keys: Sequence[int],
    which: ColumnElement[bool] | None = None,
) -> Iterator[Row[Any]]:
    """The rows with these keys."""
    wanted = select(table.c.time_us, table.c.id, *(table.c[name] for name in columns))
    for begin in range(0, len(keys), _AT_ONCE):
        some = wanted.where(table.c.id.in_(keys[begin : begin + _AT_ONCE]))
        yield from connection.execute(some if which is None else some.where(which))
