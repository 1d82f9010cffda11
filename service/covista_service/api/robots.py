"""Robots."""

from __future__ import annotations

from covista_schemas.reports import RobotReport, RobotsReport
from fastapi import APIRouter, Response

from covista_service import answers
from covista_service.api import examples
from covista_service.api.deps import PartsNow, RobotPath, SnapshotNow, answer
from covista_service.api.errors import describe

router = APIRouter(prefix="/robots", tags=["robots"])


@router.get("", response_model=RobotsReport, responses=examples.show(examples.ROBOTS))
def robots(parts: PartsNow, snapshot: SnapshotNow) -> Response:
    """All robots: presence, group, pose, camera, and what became of their messages."""
    return answer(answers.robots_report(snapshot), parts.outgoing)


@router.get("/{robot}", response_model=RobotReport, responses={**examples.show(examples.ROBOT), **describe(404)})
def robot(robot: RobotPath, snapshot: SnapshotNow) -> Response:
    """One robot."""
    return answer(answers.robot_report(snapshot, robot))
