"""Pairs of robots: what both see."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Annotated, Any, Literal

from covista_schemas.reports import PairHistory, PairReport, PairsReport
from fastapi import APIRouter, Query, Response

from covista_service import answers
from covista_service.answers import NotKnownError
from covista_service.answers.past import PAGE
from covista_service.api import examples
from covista_service.api.delivery import Delivery
from covista_service.api.deps import JSON, PartsNow, RobotPath, SnapshotNow, answer
from covista_service.api.errors import describe
from covista_service.api.past import (
    PROBLEMS,
    FromQuery,
    HistoryCursor,
    LimitQuery,
    PageQuery,
    PairsCursor,
    UntilQuery,
    read_past,
    span_ns,
)

router = APIRouter(prefix="/pairs", tags=["pairs"])

_PICTURE: dict[int | str, dict[str, Any]] = {
    200: {"content": {"image/png": {"schema": {"type": "string", "format": "binary"}}}}
}
_PAST: dict[int | str, dict[str, Any]] = {**describe(404), **PROBLEMS}
SideQuery = Annotated[Literal["a", "b"], Query(description="In whose keyframe it is drawn.")]
RobotQuery = Annotated[RobotPath | None, Query(description="Only pairs of this robot.")]
ShareQuery = Annotated[
    float | None, Query(ge=0, le=1, description="Only pairs where one sees at least this share of the other's image.")
]


@router.get("", response_model=PairsReport, responses={**examples.show(examples.PAIRS), **describe(404, 503)})
async def pairs(
    parts: PartsNow,
    snapshot: SnapshotNow,
    robot: RobotQuery = None,
    min_overlap: ShareQuery = None,
    limit: LimitQuery = None,
    cursor: PairsCursor = None,
) -> Response:
    """All pairs, each unordered pair once, in the order of their ids."""
    if robot is not None or limit is not None or cursor is not None:
        page = await asyncio.to_thread(answers.pairs_page, snapshot, robot, min_overlap, cursor, limit)
        return answer(page, parts.outgoing)
    body = await parts.outgoing.share(
        f"pairs {min_overlap}", lambda: "", lambda: partial(answers.pairs_json, parts.loop.snapshot(), min_overlap)
    )
    return Delivery(body, parts.outgoing, JSON)


@router.get("/{a}/{b}", response_model=PairReport, responses={**examples.show(examples.PAIR), **describe(404)})
def pair(a: RobotPath, b: RobotPath, snapshot: SnapshotNow) -> Response:
    """One pair in full, in the order asked for; perhaps `unknown`, with null overlaps."""
    return answer(answers.pair_report(snapshot, a, b))


@router.get("/{a}/{b}/history", response_model=PairHistory, responses={**examples.show(examples.PAIR_HISTORY), **_PAST})
async def history(
    a: RobotPath,
    b: RobotPath,
    parts: PartsNow,
    since: FromQuery = None,
    until: UntilQuery = None,
    cursor: HistoryCursor = None,
    limit: PageQuery = PAGE,
) -> Response:
    """The overlap of a pair over time in the order asked for, thinned: a moment is kept where it is news.

    Robots that are forgotten by now have a past all the same; it is empty where nothing is kept.
    """
    if a == b:
        raise NotKnownError("Unknown pair", f"{a!r} makes no pair with itself")
    span = span_ns(since, until)
    return await read_past(parts, lambda archive: archive.pair(a, b, *span, cursor, limit))


@router.get("/{a}/{b}/overlay.png", response_class=Response, responses={**_PICTURE, **describe(404)})
def overlay_picture(a: RobotPath, b: RobotPath, snapshot: SnapshotNow, side: SideQuery = "a") -> Response:
    """The common field drawn in the keyframe of one side: what the other does not see is dimmed."""
    drawn = a if side == "a" else b
    return Response(answers.pair_picture(answers.find_pair(snapshot, a, b), drawn), media_type="image/png")
