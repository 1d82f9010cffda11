"""Pages of what the station knows now: in the order of ids, each after the last id of the page before."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice

from covista_schemas import reports
from covista_schemas.keys import ID_PATTERN

from covista_service.answers.pairs import pair_summary
from covista_service.answers.past import CursorError
from covista_service.answers.robots import find_robot, robot_view_report
from covista_service.station.events import Pair
from covista_service.station.pairs import pair_of
from covista_service.station.snapshot import Snapshot

# What cursors look like: every word of the form is one, for there is a place behind every id.
ROBOT_CURSOR = rf"^{ID_PATTERN}\.$"
PAIR_CURSOR = rf"^{ID_PATTERN}\.{ID_PATTERN}$"


def robots_page(snapshot: Snapshot, cursor: str | None = None, limit: int | None = None) -> reports.RobotsReport:
    """Robots after a cursor, `limit` of them at most. Raises CursorError."""
    after = "" if cursor is None else _read(ROBOT_CURSOR, cursor)[0]
    names = [robot for robot in snapshot.robots if robot > after]
    page = names[:limit]
    more = len(page) < len(names)
    return reports.RobotsReport(
        robots=[robot_view_report(snapshot.robots[robot]) for robot in page], next=_written(page[-1]) if more else None
    )


def pairs_page(
    snapshot: Snapshot, robot: str | None, min_overlap: float | None, cursor: str | None, limit: int | None
) -> reports.PairsReport:
    """Pairs after a cursor as `pairs_report` lists them, `limit` at most. Raises CursorError and NotKnownError."""
    after = None if cursor is None else _read(PAIR_CURSOR, cursor)
    if robot is not None:
        find_robot(snapshot, robot)
    listed = (
        summary
        for pair in _pairs(snapshot, robot, after, recorded=bool(min_overlap))
        if (summary := pair_summary(snapshot.pair(*pair), min_overlap or 0.0)) is not None
    )
    page = list(islice(listed, limit))
    more = limit is not None and len(page) == limit and next(listed, None) is not None
    return reports.PairsReport(pairs=page, next=_written(page[-1].a, page[-1].b) if more else None)


def _pairs(snapshot: Snapshot, robot: str | None, after: Pair | None, *, recorded: bool) -> Iterator[Pair]:
    """Names of pairs after one, in order."""
    if robot is not None:
        found = (pair_of(robot, other) for other in snapshot.robots if other != robot)
        yield from (pair for pair in found if after is None or pair > after)
    elif recorded:
        yield from (pair for pair in sorted(snapshot.records) if after is None or pair > after)
    else:
        names = sorted(snapshot.robots)
        for i, first in enumerate(names):
            if after is None or first >= after[0]:
                yield from ((first, other) for other in names[i + 1 :] if after is None or (first, other) > after)


def _written(first: str, second: str = "") -> str:
    return f"{first}.{second}"


def _read(form: str, cursor: str) -> Pair:
    if not re.fullmatch(form, cursor):
        raise CursorError("cursor: not one that a page of this list has given")
    first, _, second = cursor.partition(".")
    return first, second
