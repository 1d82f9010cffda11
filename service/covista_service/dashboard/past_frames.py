"""The swarm at a moment of the past, in the form of that of now (`frames`), so that the same map shows both."""

from __future__ import annotations

from typing import Any

import numpy as np
from covista_schemas import reports
from covista_schemas.reports import GroupsReport, Status, TrackPoint

from covista_service.answers.past import Moment
from covista_service.dashboard.frames import corners, edges_between, rounded
from covista_service.perception.camera import Camera, Pose, rotation_of
from covista_service.station.options import NS_PER_S
from covista_service.station.snapshot import Snapshot

# By default the station forgets a robot after so long, and an overlap is unknown then.
REACH_S = 600.0
# A robot that sends poses has a point at least once a minute.
_QUIET_S = 90.0


def past_frame(moment: Moment, snapshot: Snapshot, time_ns: int) -> dict[str, Any]:
    """A frame of what was known then. Views are drawn with the cameras that robots have now: those are not kept."""
    label_of, reasons = standing(moment.groups)
    names = sorted(label_of.keys() | reasons.keys() | moment.points.keys())
    points = [moment.points.get(name) for name in names]
    silent_s = [None if point is None else _silent_s(point, time_ns) for point in points]
    return {
        "time": reports.time_of(time_ns).isoformat(),
        "since": None if moment.groups is None else moment.groups.time.isoformat(),
        "revision": None if moment.groups is None else moment.groups.revision,
        "matrix": None,
        "robots": {
            "id": names,
            "status": [_status(reasons.get(name), silent) for name, silent in zip(names, silent_s, strict=True)],
            "group": [label_of.get(name) for name in names],
            "reason": [reasons.get(name) for name in names],
            "at_m": [None if point is None else rounded(np.array(point.position_m)) for point in points],
            "view": [_view(snapshot, name, point) for name, point in zip(names, points, strict=True)],
            "silent_s": silent_s,
            "off_deg": [None] * len(names),
        },
        "edges": _edges(moment, names),
    }


def standing(groups: GroupsReport | None) -> tuple[dict[str, str], dict[str, str]]:
    """Who was in which group, and why who was in none."""
    if groups is None:
        return {}, {}
    label_of = {robot: group.label for group in groups.groups for robot in group.robots}
    return label_of, {each.robot: each.reason for each in groups.ungrouped}


def _silent_s(point: TrackPoint, time_ns: int) -> float:
    return round(max(0.0, (reports.time_of(time_ns) - point.time).total_seconds()), 1)


def _status(reason: str | None, silent_s: float | None) -> Status:
    """As it may be told from points: that a robot was silent for seconds only is not kept."""
    if reason == "gone":
        return Status.GONE
    return Status.LIVE if silent_s is not None and silent_s <= _QUIET_S else Status.STALE


def _view(snapshot: Snapshot, robot: str, point: TrackPoint | None) -> list[float] | None:
    camera: Camera | None = snapshot.robots[robot].camera if robot in snapshot.robots else None
    if camera is None or point is None:
        return None
    return corners(camera, Pose(rotation_of(point.orientation_xyzw), np.array(point.position_m)))


def _edges(moment: Moment, names: list[str]) -> dict[str, Any]:
    place = {name: k for k, name in enumerate(names)}
    overlap = np.zeros((len(names), len(names)))
    for (a, b), (of_a, of_b) in moment.overlaps.items():
        if a in place and b in place:
            overlap[place[a], place[b]], overlap[place[b], place[a]] = of_a, of_b
    return edges_between(names, overlap)


def nanoseconds(milliseconds: int) -> int:
    """Of a browser's time."""
    return milliseconds * (NS_PER_S // 1000)
