"""What routes of the history share: from when to when, cursors, and reading in threads."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Annotated, Any, TypeVar

from covista_schemas.reports import Report
from fastapi import Query, Response
from pydantic import BeforeValidator

from covista_service import answers
from covista_service.answers.past import Archive
from covista_service.api.deps import Parts, answer
from covista_service.api.errors import ContradictionError, describe

MOST = 1000
_R = TypeVar("_R", bound=Report)
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
# A plus that was not escaped in a query comes as a space.
_RFC_3339 = re.compile(r"\d{4}-\d\d-\d\d[Tt ]\d\d:\d\d:\d\d(\.\d+)?([Zz]|[+\- ]\d\d:\d\d)")


def _read_time(value: object) -> object:
    if isinstance(value, datetime):
        return value
    if not isinstance(value, str) or not _RFC_3339.fullmatch(value):
        raise ValueError("not a time as in RFC 3339, such as 2026-05-04T12:30:15Z")
    whole, offset = (value[:-1], "+00:00") if value[-1] in "Zz" else (value[:-6], value[-6:].replace(" ", "+"))
    # A leap second belongs to the minute before it.
    return datetime.fromisoformat(re.sub(r"(?<=:\d\d:)60(\.\d+)?$", "59.999999", whole) + offset)


Moment = Annotated[datetime, BeforeValidator(_read_time)]
FromQuery = Annotated[
    Moment | None, Query(alias="from", description="Nothing older (RFC 3339).", examples=["2026-05-04T12:00:00Z"])
]
UntilQuery = Annotated[
    Moment | None,
    Query(alias="to", description="Only what is older than this (RFC 3339).", examples=["2026-05-04T13:00:00Z"]),
]
_NEXT = "`next` of the page before, as it came."
# Any 16 bytes are a place in the history, and this is how they are written.
HistoryCursor = Annotated[str | None, Query(pattern="^[A-Za-z0-9_-]{21}[AQgw]$", description=_NEXT)]
RobotsCursor = Annotated[str | None, Query(pattern=answers.ROBOT_CURSOR, description=_NEXT)]
PairsCursor = Annotated[str | None, Query(pattern=answers.PAIR_CURSOR, description=_NEXT)]
PageQuery = Annotated[int, Query(ge=1, le=MOST, description="How many entries a page has at most.")]
LimitQuery = Annotated[
    int | None, Query(ge=1, le=MOST, description="How many a page has at most; all there are without it.")
]
# What every route of the history may answer besides a page.
PROBLEMS: dict[int | str, dict[str, Any]] = describe(409, 503)


def time_ns(moment: datetime) -> int:
    """A moment in ns since the epoch, exactly."""
    since = moment - _EPOCH
    return ((since.days * 86_400 + since.seconds) * 1_000_000 + since.microseconds) * 1000


def span_ns(since: datetime | None, until: datetime | None) -> tuple[int | None, int | None]:
    """From when to when. Raises ContradictionError for a span that ends before it begins."""
    if since is not None and until is not None and since > until:
        raise ContradictionError("from must not be after to")
    return None if since is None else time_ns(since), None if until is None else time_ns(until)


async def read_past(parts: Parts, ask: Callable[[Archive], _R]) -> Response:
    """Ask the history in a thread. Raises HistoryUnavailableError, CursorError or FullError."""
    return answer(await parts.readers.run(lambda: ask(parts.archive)), parts.outgoing)
