"""What a station that starts remembers of the one before it, out of the database.

What cannot be read, or makes no sense, is passed over and counted: no station fails to start for what it remembers.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

import numpy as np
from covista_schemas import messages
from covista_schemas.reports import GroupsReport
from sqlalchemy import Connection, RowMapping, select

from covista_service.perception.camera import Camera, Pose, rotation_of
from covista_service.perception.certainty import Interval
from covista_service.station.events import KeyframeId, Pair
from covista_service.station.memory import Memory, RememberedKeyframe, RememberedPair, RememberedRobot
from covista_service.store.numbers import LastNumbers
from covista_service.store.tables import POSE, group_revisions, keyframes_now, pairs_now, robots_now
from covista_service.telemetry import about

log = logging.getLogger(__name__)
_T = TypeVar("_T")
_Keyframes = Mapping[KeyframeId, RememberedKeyframe]


def recollect(connection: Connection, numbers: LastNumbers, robots_since_ns: int, pairs_since_ns: int) -> Memory:
    """Robots that were heard of since, pairs that were computed since, the groups on show, and the numbers."""
    rows = {
        table: connection.execute(select(table)).mappings().all() for table in (keyframes_now, robots_now, pairs_now)
    }
    newest = select(group_revisions.c.report).order_by(group_revisions.c.id.desc()).limit(1)
    report = connection.execute(newest).scalar()
    keyframes = {each.id: each for each in _readable(_keyframe, rows[keyframes_now])}
    robots = _readable(lambda row: _robot(row, keyframes), rows[robots_now])
    known = [row for row in rows[pairs_now] if row["computed_ns"] is not None]
    pairs = _readable(lambda row: _pair(row, keyframes), known)
    unknown = {(row["a"], row["b"]) for row in rows[pairs_now]} - {(row["a"], row["b"]) for row in known}
    standing = {robot.id: robot for robot in robots if robot.last_seen_ns >= robots_since_ns}
    return Memory(
        robots=tuple(standing.values()),
        pairs=tuple(each for each in pairs if each.computed_ns >= pairs_since_ns and _among(each.pair, standing)),
        unknown=frozenset(pair for pair in unknown if _among(pair, standing)),
        groups={} if report is None else next(iter(_readable(_groups, [report])), {}),
        revision=numbers.revision,
        label=numbers.label,
        event=numbers.event,
    )


def _among(pair: Pair, robots: Mapping[str, object]) -> bool:
    return pair[0] in robots and pair[1] in robots


def _readable(read: Callable[[Any], _T], rows: Iterable[Any]) -> list[_T]:
    found, failed, said = list[_T](), 0, ""
    for row in rows:
        try:
            found.append(read(row))
        except (ValueError, TypeError, KeyError, ArithmeticError) as error:
            failed, said = failed + 1, str(error).splitlines()[0]
    if failed:
        log.warning("some of what was remembered cannot be read", extra=about(rows=failed, said=said))
    return found


def _groups(report: str) -> Mapping[str, frozenset[str]]:
    return {group.label: frozenset(group.robots) for group in GroupsReport.read(report).groups}


def _robot(row: RowMapping, keyframes: _Keyframes) -> RememberedRobot:
    named = row["keyframe_boot"] is not None
    judged_ns = row["judged_ns"]
    return RememberedRobot(
        id=row["robot"],
        last_seen_ns=int(row["last_seen_ns"]),
        boot=row["boot"],
        pose=None if row["pose_time_ns"] is None else _pose(row),
        pose_time_ns=int(row["pose_time_ns"] or 0),
        keyframe=keyframes[KeyframeId(row["robot"], row["keyframe_boot"], row["keyframe_sequence"])] if named else None,
        judged_ns=None if judged_ns is None else int(judged_ns),
    )


def _pair(row: RowMapping, keyframes: _Keyframes) -> RememberedPair:
    a, b = row["a"], row["b"]
    if not a < b:
        raise ValueError(f"{a} and {b} are in no order")
    first = keyframes[KeyframeId(a, row["boot_a"], row["sequence_a"])]
    second = keyframes[KeyframeId(b, row["boot_b"], row["sequence_b"])]
    one, other = _interval(row, "a"), _interval(row, "b")
    times = (row["pose_time_a_ns"], row["pose_time_b_ns"])
    return RememberedPair(
        pair=(a, b),
        overlaps=(_share(row["overlap_a"]), _share(row["overlap_b"])),
        computed_ns=int(row["computed_ns"]),
        keyframes=(first, second),
        intervals=None if one is None or other is None else (one, other),
        times_ns=None if None in times else times,
    )


def _interval(row: RowMapping, side: str) -> Interval | None:
    low, high = row[f"low_{side}"], row[f"high_{side}"]
    return None if low is None or high is None else (_share(low), _share(high))


def _share(value: float) -> float:
    if not 0 <= value <= 1:
        raise ValueError(f"{value} is no share")
    return float(value)


def _keyframe(row: RowMapping) -> RememberedKeyframe:
    return RememberedKeyframe(
        id=KeyframeId(row["robot"], row["boot"], int(row["sequence"])),
        time_ns=int(row["time_ns"]),
        arrived_ns=int(row["arrived_ns"]),
        camera=_camera(messages.Camera.model_validate_json(row["camera"])),
        pose=_pose(row),
    )


def _pose(row: RowMapping) -> Pose:
    values = [float(row[name]) for name in POSE]
    x, y, z, w = values[3:]
    if not all(map(math.isfinite, values)) or x * x + y * y + z * z + w * w < 1e-6:
        raise ValueError("a pose that is none")
    return Pose(rotation_of((x, y, z, w)), np.array(values[:3]))


def _camera(told: messages.Camera) -> Camera:
    matrix = np.array([[told.fx, 0.0, told.cx], [0.0, told.fy, told.cy], [0.0, 0.0, 1.0]])
    return Camera(matrix, told.width, told.height, told.distortion.model, tuple(told.distortion.coefficients))
