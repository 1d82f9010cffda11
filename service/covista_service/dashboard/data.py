"""What scripts of the pages ask for that REST does not have. Not an interface for others: it follows the pages."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic_core import to_json

from covista_service.access import Door, Scope
from covista_service.access.scopes import covers
from covista_service.access.sessions import COOKIE
from covista_service.answers import NotKnownError
from covista_service.dashboard.data_pairs import RobotQuery
from covista_service.dashboard.data_pairs import router as pairs_router
from covista_service.dashboard.sources import Sources, SourcesNow
from covista_service.dashboard.why import why

JSON = "application/json"

router = APIRouter(prefix="/data", include_in_schema=False)
router.include_router(pairs_router)


@router.get("/session")
async def session(request: Request, sources: SourcesNow) -> Response:
    """Which start of the station this is, as whom one has come, and what that allows."""
    return answer({"station": sources.name, **_who(sources, request.cookies.get(COOKIE, ""))})


@router.get("/swarm")
async def swarm(sources: SourcesNow, matrix: Annotated[int | None, Query()] = None) -> Response:
    """The swarm now, for its map."""
    return Response(await sources.frames.swarm(sources.name, sources.loop.snapshot, matrix), media_type=JSON)


@router.get("/why")
async def reasons(sources: SourcesNow, a: RobotQuery, b: RobotQuery) -> Response:
    """Why two robots are in one group, or are not; a `problem`, and no error, where one of them is not known."""
    try:
        return answer({"sentences": why(sources.loop.snapshot(), a, b)})
    except NotKnownError as error:
        return answer({"sentences": [], "problem": error.detail})


def answer(found: object) -> Response:
    """As JSON."""
    return Response(to_json(found), media_type=JSON)


def _who(sources: Sources, cookie: str) -> dict[str, object]:
    if sources.gate.keyring.door is Door.OPEN:
        return {"name": None, "operates": True}
    found = sources.gate.sessions.find(cookie)
    # Who asks with a token of REST, and has no session.
    if found is None:
        return {"name": None, "operates": False}
    return {"name": found.name, "operates": covers(found.scopes, Scope.OPERATE)}
