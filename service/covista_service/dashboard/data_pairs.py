"""What pages ask for about two robots."""

from __future__ import annotations

from typing import Annotated

from covista_schemas.keys import ID_PATTERN
from covista_schemas.reports import time_of
from fastapi import APIRouter, Query, Response
from pydantic_core import to_json

from covista_service.answers import NotKnownError
from covista_service.dashboard.pair_facts import pair_facts
from covista_service.dashboard.sources import SourcesNow
from covista_service.station.options import NS_PER_S

_JSON = "application/json"
RobotQuery = Annotated[str, Query(pattern=f"^{ID_PATTERN}$")]

router = APIRouter(prefix="/pair")


@router.get("")
async def facts(sources: SourcesNow, a: RobotQuery, b: RobotQuery) -> Response:
    """What is known of two robots at which `time`, as often as a mouse moves; a `problem` where they are no pair.

    That is no error, of which browsers would complain each second that somebody looks at a robot that is not there.
    """
    snapshot = sources.loop.snapshot()
    try:
        told = pair_facts(snapshot, a, b)
    except NotKnownError as error:
        told = {"a": a, "b": b, "problem": error.detail}
    return Response(to_json({"time": time_of(snapshot.wall_ns).isoformat(), **told}), media_type=_JSON)


@router.get("/look")
async def look(
    sources: SourcesNow, a: RobotQuery, b: RobotQuery, newest: bool = False, known: Annotated[str, Query()] = ""
) -> Response:
    """Both keyframes with the common field, and the planes, of one moment; without them for who has that version.

    Of the moment when the images last told planes, if that is not long ago, or of the newest keyframes.
    """
    snapshot = sources.loop.snapshot()
    found = sources.looks.note(snapshot, a, b) if newest else sources.looks.best(snapshot, a, b)
    told = {"version": found.version, "since_s": round((snapshot.now_ns - found.at_ns) / NS_PER_S, 1)}
    if found.version != known:
        # Drawing takes some ten milliseconds, and clustering planes as many.
        told |= await sources.drawing.run(lambda: sources.looks.drawn(found, a))
    return Response(to_json(told), media_type=_JSON)
