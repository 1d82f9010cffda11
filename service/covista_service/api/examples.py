"""One example of each answer, for the OpenAPI description; checked by being built from the models.

FastAPI leaves null fields out of examples, so they have none that is required.
"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Any

from covista_schemas.messages import Camera
from covista_schemas.reports import (
    Counters,
    EventKind,
    EventReport,
    EventsHistory,
    FoundBy,
    Gap,
    Group,
    GroupsHistory,
    GroupsReport,
    Health,
    KeyframeId,
    LiveSettings,
    PairHistory,
    PairKeyframes,
    PairMoment,
    PairReport,
    PairsReport,
    PairSummary,
    PartHealth,
    PlaneReport,
    PoseCorrection,
    PoseReport,
    Report,
    RobotReport,
    RobotsReport,
    RobotTrack,
    Score,
    SimilarityReport,
    Status,
    TrackPoint,
    Ungrouped,
)
from fastapi.openapi.models import Example

_TIME = datetime(2026, 5, 4, 12, 30, 15, tzinfo=UTC)
_KEYFRAME = KeyframeId(boot="b7f3", sequence=41)

ROBOT = RobotReport(
    id="r1",
    status=Status.LIVE,
    group="g1",
    pose=PoseReport(position_m=(1.2, -0.4, 0.6), orientation_xyzw=(-0.5, 0.5, -0.5, 0.5), time=_TIME),
    camera=Camera(fx=500, fy=500, cx=320, cy=240, width=640, height=480),
    boot="b7f3",
    keyframe=_KEYFRAME,
    heard=_KEYFRAME,
    last_seen=_TIME,
    clock_offset_s=-0.02,
    pose_correction=PoseCorrection(deg=0.4, m=0.02),
    keyframes=Counters(received=42, used=40, replaced=1, dropped={"bad_image": 1}),
    poses=Counters(received=420, used=420),
    last_problem="image: truncated after 5120 bytes",
)
ROBOTS = RobotsReport(robots=[ROBOT])
PAIR = PairReport(
    a="r1",
    b="r2",
    overlap_a=0.51,
    overlap_b=0.89,
    found_by=FoundBy.IMAGE,
    outcome="measured",
    inliers=143,
    pose_source="reported",
    age_s=0.4,
    keyframes=PairKeyframes(a=_KEYFRAME, b=KeyframeId(boot="c01d", sequence=17)),
    regions_a=[[(310.5, -0.5), (639.5, -0.5), (639.5, 479.5), (310.5, 479.5)]],
    regions_b=[[(-0.5, 20.0), (570.0, -0.5), (570.0, 479.5), (-0.5, 460.0)]],
    planes=[
        PlaneReport(
            normal=(0.0, 0.0, -1.0),
            offset_m=3.0,
            support=143,
            polygon_a=[(310.5, -0.5), (639.5, -0.5), (639.5, 479.5), (310.5, 479.5)],
            polygon_b=[(-0.5, 20.0), (570.0, -0.5), (570.0, 479.5), (-0.5, 460.0)],
        )
    ],
)
PAIRS = PairsReport(pairs=[PairSummary.model_validate(PAIR.model_dump())])
SIMILARITY = SimilarityReport(
    revision=12,
    robots=["r1", "r2"],
    similarity=[[1.0, 0.71], [0.71, 1.0]],
    overlap=[[1.0, 0.51], [0.89, 1.0]],
    closeness=[[1.0, 0.72], [0.72, 1.0]],
    distance_m=[[0.0, 1.4], [1.4, 0.0]],
)
GROUP = Group(label="g1", robots=["r1", "r2"])
GROUPS = GroupsReport(
    revision=7,
    time=_TIME,
    groups=[GROUP],
    ungrouped=[Ungrouped(robot="r3", reason="no_pose")],
    criterion="adaptive",
    scores=[Score(groups=1, score=0.83)],
    settings=LiveSettings(),
)
EVENT = EventReport(
    id=118,
    event=EventKind.JOIN,
    time=_TIME,
    robots=["r2"],
    labels=["g1"],
    revision_before=6,
    revision_after=7,
    text="r2 joined g1",
)
_GAP = Gap(since=_TIME, until=_TIME + timedelta(seconds=30), lost=12, reason="the database could not be used")
_CURSOR = "MTE4"
EVENTS_HISTORY = EventsHistory(items=[EVENT], next=_CURSOR, gaps=[_GAP])
GROUPS_HISTORY = GroupsHistory(items=[GROUPS], next=_CURSOR)
PAIR_HISTORY = PairHistory(
    a="r1",
    b="r2",
    items=[PairMoment(time=_TIME, overlap_a=0.51, overlap_b=0.89, found_by=FoundBy.IMAGE)],
    next=_CURSOR,
)
TRACK = RobotTrack(
    robot="r1",
    items=[TrackPoint(position_m=(1.2, -0.4, 0.6), orientation_xyzw=(-0.5, 0.5, -0.5, 0.5), time=_TIME)],
    next=_CURSOR,
)
SETTINGS = LiveSettings()
PATCHES: dict[str, Example] = {
    "one": {"summary": "One setting", "value": {"alpha": 0.7}},
    "part": {"summary": "A part of the hysteresis", "value": {"hysteresis": {"persistence_s": 2.0}}},
    "bounds": {
        "summary": "Two to four groups, by the gain",
        "value": {"groups": {"min": 2, "max": 4}, "criterion": "gain"},
    },
}
STREAM = f"id: {EVENT.id}\nevent: {EVENT.event}\ndata: {EVENT.model_dump_json()}\n\n: alive\n\n"
HEALTH = Health(status="ready", parts={"link": PartHealth(status="ready", detail="tcp/127.0.0.1:7447")})
UNCHANGED: dict[int | str, dict[str, Any]] = {304: {"description": "Not changed since If-None-Match's version"}}


def show(report: Report) -> dict[int | str, dict[str, Any]]:
    """The report as a route's example."""
    return {200: {"content": {"application/json": {"example": report.model_dump(mode="json")}}}}
