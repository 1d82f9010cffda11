"""What the page of one robot asks for that REST does not have: its view as a picture, and words."""

from __future__ import annotations

from typing import Annotated

from covista_schemas.keys import ID_PATTERN
from covista_schemas.reports import time_of
from fastapi import APIRouter, Depends, Path, Response
from pydantic_core import to_json

from covista_service.answers import NotKnownError, find_robot
from covista_service.dashboard import robot_words
from covista_service.dashboard.sources import SourcesNow
from covista_service.drawing import view as drawn
from covista_service.station.snapshot import Snapshot

RobotPath = Annotated[str, Path(pattern=f"^{ID_PATTERN}$")]
router = APIRouter(prefix="/data/robots/{robot}", include_in_schema=False)


async def _snapshot(sources: SourcesNow) -> Snapshot:
    """In the thread of the event loop; pictures are drawn in others."""
    return sources.loop.snapshot()


@router.get("/words")
async def words(robot: RobotPath, sources: SourcesNow) -> Response:
    """The robot in sentences. One that is not known is no error: the page says so, and goes on asking."""
    snapshot = sources.loop.snapshot()
    view = snapshot.robots.get(robot)
    found: dict[str, object] = {
        "station": sources.name,
        "time": time_of(snapshot.wall_ns).isoformat(),
        "known": view is not None,
    }
    if view is not None:
        found |= {
            "standing": robot_words.standing(snapshot, view),
            "silent": robot_words.silent_beside(snapshot, view),
            "clock": robot_words.clock(view.clock_offset_s),
            "pose": robot_words.pose(view),
            "dropped": robot_words.dropped(view),
            "picture": robot_words.picture(view.in_use),
        }
    return Response(to_json(found), media_type="application/json")


@router.get("/view.png")
def view(robot: RobotPath, snapshot: Annotated[Snapshot, Depends(_snapshot)]) -> Response:
    """What it sees: its newest keyframe. Raises NotKnownError."""
    keyframe = find_robot(snapshot, robot).in_use
    told = robot_words.picture(keyframe)
    if keyframe is None or told["key"] is None:
        raise NotKnownError("No picture", told["words"])
    # The address names the keyframe, so that one that came meanwhile is asked for anew.
    return Response(drawn(keyframe), media_type="image/png", headers={"cache-control": "no-store"})
