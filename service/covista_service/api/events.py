"""What happens: as a stream, and what has happened."""

from __future__ import annotations

from typing import Annotated, Any

from covista_schemas.reports import EventKind, EventsHistory, RobotId
from fastapi import APIRouter, Header, Query, Response

from covista_service.answers.past import PAGE
from covista_service.api import examples
from covista_service.api.deps import PartsNow
from covista_service.api.errors import describe
from covista_service.api.listening import Listening
from covista_service.api.past import PROBLEMS, FromQuery, HistoryCursor, PageQuery, UntilQuery, read_past, span_ns
from covista_service.api.stream import EVENT_STREAM

router = APIRouter(prefix="/events", tags=["events"])

# Numbers of events fit a database's.
_MOST = 2**63 - 1
_AFTER = "Id of the last event that came; what happened since is sent first."
LastIdHeader = Annotated[int | None, Header(alias="Last-Event-ID", ge=0, le=_MOST, description=_AFTER)]
LastIdQuery = Annotated[
    int | None, Query(ge=0, le=_MOST, description=f"{_AFTER} For who cannot set headers; the header goes first.")
]
KindQuery = Annotated[list[EventKind] | None, Query(description="Only events of this kind, or of these.")]
RobotQuery = Annotated[RobotId | None, Query(description="Only events that name this robot.")]
# OpenAPI 3.1 has no word for streams: the schema is that of each event.
_EVENT = {
    "type": "object",
    "description": "Each event of the stream.",
    "properties": {
        "id": {"type": "string", "pattern": "^[0-9]+$", "description": "Of the last event: for Last-Event-ID."},
        "event": {"type": "string", "enum": [*EventKind, "reset", "cut"]},
        "data": {
            "type": "string",
            "contentMediaType": "application/json",
            "contentSchema": {
                "anyOf": [
                    {"$ref": f"#/components/schemas/{name}"} for name in ("EventReport", "EventsMissed", "Problem")
                ]
            },
        },
    },
    "required": ["event", "data"],
}
_STREAM: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "Events as they happen, until the client goes.",
        "content": {EVENT_STREAM: {"schema": _EVENT, "example": examples.STREAM}},
    }
}


@router.get("", response_class=Response, responses={**_STREAM, **describe(503)})
async def events(parts: PartsNow, last_id: LastIdHeader = None, last_event_id: LastIdQuery = None) -> Response:
    """Events as they happen, as server-sent events: `id`, `event` (the kind), and `data`, an EventReport as JSON.

    With the id of the last event that came, as `Last-Event-ID` or in the query, all that happened since comes first, as
    far as the history has it, with no hole and no repeat. Two kinds are of the stream itself. `reset` says that the
    events from `first` to `last`, as far as there were any, cannot be given again; what follows is complete. `cut` is
    the last word of a stream that the station ends: `data` is a Problem that says why (the station stops, the client
    reads too slowly, has listened for an hour, or may not listen any more, for its token was revoked or the first one
    was made), and who asks again with the id of the last event misses nothing. A comment comes where nothing else did
    for 15 s. At most 256 listen at a time.
    """
    return Listening(parts.stream, parts.archive, parts.readers, last_event_id if last_id is None else last_id)


@router.get("/history", response_model=EventsHistory, responses={**examples.show(examples.EVENTS_HISTORY), **PROBLEMS})
async def history(
    parts: PartsNow,
    since: FromQuery = None,
    until: UntilQuery = None,
    kind: KindQuery = None,
    robot: RobotQuery = None,
    cursor: HistoryCursor = None,
    limit: PageQuery = PAGE,
) -> Response:
    """What has happened, the oldest first. A page of one robot's events may be short and still not be the last."""
    span = span_ns(since, until)
    return await read_past(parts, lambda archive: archive.events(*span, cursor, limit, kind or (), robot))
