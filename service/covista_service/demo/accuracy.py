"""How far the station's answers are from what the rendered world says."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from functools import lru_cache

from covista_clients.simulation import truth
from covista_clients.simulation.world import World
from covista_schemas.messages import Camera, Pose
from covista_schemas.reports import KeyframeId, PairSummary, time_of

SEEN = 0.1
# The station answers with keyframes of the last seconds; older ones need not be remembered.
_REMEMBERED = 256
_STEP_PX = 4
# Times are reported to the microsecond.
_SAME = timedelta(microseconds=2)
Overlap = Callable[[Pose, Pose], float]
# The pose of a robot so many seconds after the beginning.
Where = Callable[[str, float], Pose]


@dataclass(frozen=True, slots=True)
class _Stood:
    """Where a keyframe was taken, when by the robot's clock, and when after the beginning."""

    pose: Pose
    time: datetime
    t_s: float


@dataclass(slots=True)
class Mean:
    """A running mean."""

    total: float = 0.0
    count: int = 0

    def add(self, value: float) -> None:
        """Take one more value in."""
        self.total += value
        self.count += 1

    @property
    def value(self) -> float | None:
        """The mean, None of nothing."""
        return self.total / self.count if self.count else None


@dataclass(slots=True)
class Accuracy:
    """Mean errors over all ordered pairs of all answers judged; `overlap` is the truth of two poses.

    `where` robots stood between keyframes: an answer for newer poses than those of the keyframes that it names is
    judged by the poses that it stands for.
    """

    overlap: Overlap
    where: Where
    error: Mean = field(default_factory=Mean)
    error_seen: Mean = field(default_factory=Mean)
    _poses: dict[str, OrderedDict[tuple[str, int], _Stood]] = field(default_factory=dict)

    def sent(self, robot: str, boot: str, sequence: int, pose: Pose, t_s: float) -> None:
        """Remember where a keyframe was taken, `t_s` seconds after the beginning."""
        poses = self._poses.setdefault(robot, OrderedDict())
        poses[boot, sequence] = _Stood(pose, time_of(pose.time_ns), t_s)
        if len(poses) > _REMEMBERED:
            poses.popitem(last=False)

    def judge(self, pair: PairSummary) -> None:
        """Compare an answer with the truth of the poses that it stands for, or of the newest keyframes without any.

        No overlap counts as 0. Keyframes that are not known here are left out.
        """
        keyframes, times = pair.keyframes, pair.poses
        pose_a = self._pose(pair.a, keyframes.a if keyframes else None, times.a if times else None)
        pose_b = self._pose(pair.b, keyframes.b if keyframes else None, times.b if times else None)
        if pose_a is None or pose_b is None:
            return
        self._note(pair.overlap_a, self.overlap(pose_a, pose_b))
        self._note(pair.overlap_b, self.overlap(pose_b, pose_a))

    def _pose(self, robot: str, named: KeyframeId | None, time: datetime | None) -> Pose | None:
        poses = self._poses.get(robot)
        if not poses:
            return None
        stood = poses[next(reversed(poses))] if named is None else poses.get((named.boot, named.sequence))
        if stood is None:
            return None
        if time is None or abs(time - stood.time) <= _SAME:
            return stood.pose
        return self.where(robot, stood.t_s + (time - stood.time).total_seconds())

    def _note(self, answer: float | None, actual: float) -> None:
        error = abs((answer or 0.0) - actual)
        self.error.add(error)
        if actual >= SEEN:
            self.error_seen.add(error)


def rendered_overlap(world: World, camera: Camera) -> Overlap:
    """The truth in a rendered world, remembered: answers stand for several seconds."""

    @lru_cache(maxsize=4096)
    def overlap(first: Pose, second: Pose) -> float:
        return truth.overlap(world, camera, first, camera, second, _STEP_PX)

    return overlap
