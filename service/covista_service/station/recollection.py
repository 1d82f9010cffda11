"""What of a memory makes sense: it was written by a process that was killed, perhaps under another clock."""

from __future__ import annotations

import math
import re
from collections.abc import Container, Mapping
from dataclasses import replace

from covista_schemas.keys import ID_PATTERN
from covista_schemas.messages import COEFFICIENT_COUNTS
from covista_schemas.reports import FoundBy

from covista_service.grouping.affinity import FARTHEST_M
from covista_service.grouping.continuity import Members
from covista_service.perception.camera import Camera, Pose
from covista_service.perception.certainty import Interval
from covista_service.station.events import Keyframe, KeyframeId, Pair
from covista_service.station.memory import Memory, RememberedKeyframe, RememberedPair, RememberedRobot
from covista_service.station.pairs import Answer

_ID = re.compile(ID_PATTERN)
_LABEL = re.compile(r"g([1-9][0-9]{0,17})")
# A rotation that was kept as a quaternion of few digits is one all the same.
_NEARLY = 1e-3
_FOCAL_PX, _FARTHEST_PX, _MOST_PX = (0.1, 1e6), 1e6, 65_535


class Recollection:
    """A memory as the parts of the station take it up: who shares a keyframe there shares it here."""

    def __init__(self, memory: Memory) -> None:
        self.memory = memory
        self._keyframes: dict[KeyframeId, Keyframe] = {}

    def keyframe(self, robot: RememberedRobot) -> Keyframe | None:
        """The keyframe of a robot that was in use, without features."""
        return None if robot.keyframe is None else self._keyframe(robot.keyframe)

    def answer(self, known: RememberedPair) -> Answer:
        """What stands for a pair until both its robots have told something new."""
        first, second = map(self._keyframe, known.keyframes)
        return Answer(
            known.overlaps,
            FoundBy.DECAYED,
            known.computed_ns,
            first,
            second,
            known.intervals,
            times_ns=known.times_ns,
        )

    def _keyframe(self, known: RememberedKeyframe) -> Keyframe:
        keyframe = Keyframe(known.id, known.time_ns, known.arrived_ns, known.camera, known.pose)
        return self._keyframes.setdefault(known.id, keyframe)


def sensible(memory: Memory, now_ns: int) -> Memory:
    """A memory without what contradicts the rest of it, and with nothing of a time to come; that raises nothing.

    What is no robot, place, camera or share is left out, and of what is there twice the first is taken.
    """
    robots: dict[str, RememberedRobot] = {}
    for robot in memory.robots:
        if _ID.fullmatch(robot.id) and robot.id not in robots:
            robots[robot.id] = _robot(robot, now_ns)
    pairs: dict[Pair, RememberedPair] = {}
    for known in memory.pairs:
        if known.pair not in pairs and _is_pair(known.pair, robots) and _is_known(known):
            pairs[known.pair] = _pair(known, now_ns)
    return Memory(
        robots=tuple(robots.values()),
        pairs=tuple(pairs.values()),
        unknown=frozenset(pair for pair in memory.unknown if _is_pair(pair, robots) and pair not in pairs),
        groups=_groups(memory.groups, {robot for robot, known in robots.items() if known.pose is not None}),
        revision=max(memory.revision, 0),
        label=max(memory.label, 0, *map(_number, memory.groups)),
        event=max(memory.event, 0),
    )


def _robot(robot: RememberedRobot, now_ns: int) -> RememberedRobot:
    keyframe, judged_ns = robot.keyframe, robot.judged_ns
    if keyframe is None or not _is_keyframe(keyframe, robot.id):
        keyframe = judged_ns = None
    return replace(
        robot,
        last_seen_ns=min(robot.last_seen_ns, now_ns),
        pose=robot.pose if robot.pose is not None and _is_place(robot.pose) else None,
        keyframe=None if keyframe is None else _arrived(keyframe, now_ns),
        judged_ns=None if judged_ns is None else min(judged_ns, now_ns),
    )


def _pair(known: RememberedPair, now_ns: int) -> RememberedPair:
    first, second = (_arrived(keyframe, now_ns) for keyframe in known.keyframes)
    sure = known.intervals is not None and all(map(_is_interval, known.intervals))
    return replace(
        known,
        computed_ns=min(known.computed_ns, now_ns),
        keyframes=(first, second),
        intervals=known.intervals if sure else None,
    )


def _groups(groups: Mapping[str, Members], placed: set[str]) -> dict[str, Members]:
    """Groups of robots that stand somewhere, each in one of them."""
    taken: dict[str, Members] = {}
    left = set(placed)
    for label, robots in groups.items():
        members = robots & left
        if members and _number(label):
            taken[label] = members
            left -= members
    return taken


def _number(label: str) -> int:
    """The number of a label, 0 if it is none of ours."""
    found = _LABEL.fullmatch(label)
    return 0 if found is None else int(found[1])


def _is_pair(pair: Pair, robots: Container[str]) -> bool:
    return pair[0] < pair[1] and pair[0] in robots and pair[1] in robots


def _is_known(known: RememberedPair) -> bool:
    both = zip(known.keyframes, known.pair, strict=True)
    return all(0 <= share <= 1 for share in known.overlaps) and all(_is_keyframe(*each) for each in both)


def _is_interval(interval: Interval) -> bool:
    return 0 <= interval[0] <= interval[1] <= 1


def _arrived(keyframe: RememberedKeyframe, now_ns: int) -> RememberedKeyframe:
    return keyframe if keyframe.arrived_ns <= now_ns else replace(keyframe, arrived_ns=now_ns)


def _is_keyframe(keyframe: RememberedKeyframe, robot: str) -> bool:
    return keyframe.id.robot == robot and _is_camera(keyframe.camera) and _is_place(keyframe.pose)


def _is_place(pose: Pose) -> bool:
    """Is it a rotation, and a place where a robot can be?"""
    if pose.world_from_camera.shape != (3, 3) or pose.centre_m.shape != (3,):
        return False
    # Numbers of Python's own: of so few an array's cost twenty times as much, and there are many thousand poses.
    x, y, z = pose.world_from_camera.tolist()
    dots = ((x, x, 1.0), (y, y, 1.0), (z, z, 1.0), (x, y, 0.0), (x, z, 0.0), (y, z, 0.0))
    # NaN is not less than anything.
    return all(abs(each) < FARTHEST_M for each in pose.centre_m.tolist()) and all(
        abs(one[0] * other[0] + one[1] * other[1] + one[2] * other[2] - wanted) < _NEARLY for one, other, wanted in dots
    )


def _is_camera(camera: Camera) -> bool:
    if camera.matrix.shape != (3, 3) or len(camera.coefficients) not in COEFFICIENT_COUNTS.get(camera.distortion, ()):
        return False
    (fx, skew, cx), (_, fy, cy), _ = camera.matrix.tolist()
    return (
        all(_FOCAL_PX[0] <= each <= _FOCAL_PX[1] for each in (fx, fy))
        and all(abs(each) <= _FARTHEST_PX for each in (skew, cx, cy))
        and all(0 < each <= _MOST_PX for each in (camera.width, camera.height))
        and all(map(math.isfinite, camera.coefficients))
    )
