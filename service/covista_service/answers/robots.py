"""Robots as reports."""

from __future__ import annotations

import numpy as np
from covista_schemas import messages, reports

from covista_service.answers.unknown import NotKnownError
from covista_service.perception.camera import Camera, Floats
from covista_service.station.corrections import Correction
from covista_service.station.events import KeyframeId
from covista_service.station.ledger import Counts
from covista_service.station.roster import Fix
from covista_service.station.snapshot import RobotView, Snapshot


def robots_report(snapshot: Snapshot) -> reports.RobotsReport:
    """All robots."""
    return reports.RobotsReport(robots=[robot_view_report(view) for view in snapshot.robots.values()])


def robot_report(snapshot: Snapshot, robot: str) -> reports.RobotReport:
    """One robot. Raises NotKnownError."""
    return robot_view_report(find_robot(snapshot, robot))


def find_robot(snapshot: Snapshot, robot: str) -> RobotView:
    """One robot. Raises NotKnownError."""
    view = snapshot.robots.get(robot)
    if view is None:
        raise NotKnownError("Unknown robot", f"no robot {robot[:80]!r} is known")
    return view


def robot_view_report(view: RobotView) -> reports.RobotReport:
    """A robot of a snapshot."""
    return reports.RobotReport(
        id=view.id,
        status=view.status,
        group=view.group,
        pose=_pose(view.fix) if view.fix else None,
        camera=camera_message(view.camera) if view.camera else None,
        boot=view.boot,
        keyframe=keyframe_id(view.keyframe) if view.keyframe else None,
        heard=keyframe_id(view.announced) if view.announced else None,
        last_seen=None if view.last_seen_ns is None else reports.time_of(view.last_seen_ns),
        clock_offset_s=view.clock_offset_s,
        pose_correction=_correction(view.correction) if view.correction else None,
        keyframes=_counters(view.keyframes),
        poses=_counters(view.poses),
        last_problem=view.last_problem,
    )


def _pose(fix: Fix) -> reports.PoseReport:
    x, y, z = (float(value) for value in fix.pose.centre_m)
    return reports.PoseReport(
        position_m=(x, y, z),
        orientation_xyzw=quaternion_of(fix.pose.world_from_camera),
        time=reports.time_of(fix.time_ns),
    )


def quaternion_of(rotation: Floats) -> tuple[float, float, float, float]:
    """Unit quaternion (x, y, z, w), w >= 0, of a rotation (3, 3), by its largest component (Shepperd's method)."""
    trace = float(np.trace(rotation))
    squares = [1 - trace + 2 * float(rotation[i, i]) for i in range(3)] + [1 + trace]
    largest = int(np.argmax(squares))
    skew = [float(rotation[(i + 2) % 3, (i + 1) % 3] - rotation[(i + 1) % 3, (i + 2) % 3]) for i in range(3)]
    if largest == 3:
        q = [*skew, squares[3]]
    else:
        q = [float(rotation[largest, i] + rotation[i, largest]) for i in range(3)] + [skew[largest]]
        q[largest] = squares[largest]
    x, y, z, w = (float(value) for value in np.array(q) / np.linalg.norm(q) * (-1 if q[3] < 0 else 1))
    return x, y, z, w


def camera_message(camera: Camera) -> messages.Camera:
    """The camera as it crosses the air."""
    return messages.Camera(
        fx=float(camera.matrix[0, 0]),
        fy=float(camera.matrix[1, 1]),
        cx=float(camera.matrix[0, 2]),
        cy=float(camera.matrix[1, 2]),
        width=camera.width,
        height=camera.height,
        distortion=messages.Distortion(model=camera.distortion, coefficients=camera.coefficients),
    )


def keyframe_id(keyframe: KeyframeId) -> reports.KeyframeId:
    """The keyframe's name."""
    return reports.KeyframeId(boot=keyframe.boot, sequence=keyframe.sequence)


def _correction(correction: Correction) -> reports.PoseCorrection:
    return reports.PoseCorrection(deg=correction.deg, m=correction.m)


def _counters(counts: Counts) -> reports.Counters:
    return reports.Counters(
        received=counts.received,
        used=counts.used,
        replaced=counts.replaced,
        duplicate=counts.duplicate,
        missing=counts.missing,
        waiting=counts.waiting,
        dropped=dict(counts.dropped),
    )
