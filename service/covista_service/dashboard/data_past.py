"""What the page of the past asks for that REST does not have: a moment for the map, and groups over time as bands."""

from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from pydantic import AwareDatetime
from pydantic_core import to_json

from covista_service.dashboard.bands import bands
from covista_service.dashboard.past_frames import REACH_S, nanoseconds, past_frame
from covista_service.dashboard.sources import SourcesNow

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_LATEST_MS = 253_370_764_800_000
_LONGEST_S = 31 * 86_400
MillisecondsQuery = Annotated[int | None, Query(ge=0, le=_LATEST_MS)]

router = APIRouter(prefix="/data", include_in_schema=False)


@router.get("/past")
async def past(sources: SourcesNow, moment: Annotated[AwareDatetime, Query(alias="time")]) -> Response:
    """The swarm at a moment of the past, in the form of `/swarm`. Raises HistoryUnavailableError or FullError."""
    # What is still to come is as it is now.
    time_ns = min((moment - _EPOCH) // timedelta(microseconds=1) * 1000, time.time_ns())
    snapshot = sources.loop.snapshot()
    now_ns = time.time_ns()

    def found() -> dict[str, Any]:
        then = sources.moments.at(sources.archive, time_ns, REACH_S, now_ns)
        return {"station": sources.name, **past_frame(then, snapshot, time_ns)}

    return _told(await sources.moments.run(lambda: to_json(found())))


@router.get("/bands")
async def groups_over_time(
    sources: SourcesNow,
    span_s: Annotated[float, Query(gt=0, le=_LONGEST_S)] = 300,
    since_ms: MillisecondsQuery = None,
    until_ms: MillisecondsQuery = None,
) -> Response:
    """Groups until a time, or now: of the last `span_s`, or since. Raises HistoryUnavailableError or FullError."""
    now_ns = time.time_ns()
    # Of what is still to come no groups are known.
    until_ns = now_ns if until_ms is None else min(now_ns, nanoseconds(until_ms))
    since_ns = until_ns - round(span_s * 1e9) if since_ms is None else nanoseconds(since_ms)
    since_ns = max(0, since_ns, until_ns - _LONGEST_S * 10**9)

    def found() -> dict[str, Any]:
        now = {"station": sources.name, "now_ms": now_ns // 1_000_000}
        return {**now, **bands(sources.archive, min(since_ns, until_ns), until_ns)}

    return _told(await sources.readers.run(lambda: to_json(found())))


def _told(text: bytes) -> Response:
    """What was written in a thread: a thousand robots are much text."""
    return Response(text, media_type="application/json")
