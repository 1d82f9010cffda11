"""Robots."""

from __future__ import annotations

import asyncio

from covista_schemas.reports import RobotReport, RobotsReport, RobotTrack
from fastapi import APIRouter, Response

from covista_service import answers
from covista_service.answers.past import PAGE
from covista_service.api import examples
from covista_service.api.delivery import deliver
from covista_service.api.deps import JSON, AskerNow, PartsNow, RobotPath, SnapshotNow, answer
from covista_service.api.errors import describe
from covista_service.api.past import (
    PROBLEMS,
    FromQuery,
    HistoryCursor,
    LimitQuery,
    PageQuery,
    RobotsCursor,
    UntilQuery,
    read_past,
    span_ns,
)
from covista_service.station.events import ForgetRobot

router = APIRouter(prefix="/robots", tags=["robots"])


@router.get("", response_model=RobotsReport, responses={**examples.show(examples.ROBOTS), **describe(503)})
async def robots(
    parts: PartsNow, snapshot: SnapshotNow, limit: LimitQuery = None, cursor: RobotsCursor = None
) -> Response:
    """All robots in the order of their ids: presence, group, pose, camera, and what became of their messages."""
    if limit is None and cursor is None:
        return deliver(await parts.texts.robots(snapshot), parts.outgoing, JSON)
    page = await asyncio.to_thread(answers.robots_page, snapshot, cursor, limit)
    return answer(page, parts.outgoing)


@router.get("/{robot}", response_model=RobotReport, responses={**examples.show(examples.ROBOT), **describe(404)})
def robot(robot: RobotPath, snapshot: SnapshotNow) -> Response:
    """One robot."""
    return answer(answers.robot_report(snapshot, robot))


@router.get("/{robot}/track", response_model=RobotTrack, responses={**examples.show(examples.TRACK), **PROBLEMS})
async def track(
    robot: RobotPath,
    parts: PartsNow,
    since: FromQuery = None,
    until: UntilQuery = None,
    cursor: HistoryCursor = None,
    limit: PageQuery = PAGE,
) -> Response:
    """Where a robot was, thinned; also one that is forgotten by now. Empty for one that nothing is kept of."""
    span = span_ns(since, until)
    return await read_past(parts, lambda archive: archive.track(robot, *span, cursor, limit))


@router.delete("/{robot}", status_code=204, response_class=Response, responses=describe(404, 503))
async def forget(robot: RobotPath, parts: PartsNow, by: AskerNow) -> Response:
    """Forget a robot: its group, pairs and keyframes. One that still sends comes back as a newcomer."""
    answers.find_robot(parts.loop.snapshot(), robot)
    await parts.loop.do(ForgetRobot(robot, by))
    return Response(status_code=204)
