"""What is known of one robot: its newest keyframe, its last outlook, and what it saw and where it was before."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from covista_service.perception.agreement import Observations
from covista_service.perception.camera import Pose, relative
from covista_service.perception.surface import Surface
from covista_service.perception.warp import Carried
from covista_service.station.events import Keyframe, KeyframeId
from covista_service.station.outlook import Outlook

# Depths that keyframes replaced since have given to one that is still in use.
_BESIDE = 8
# Earlier keyframes of a robot that its next ones are held against.
_WINDOW = 4
# A robot's own motion tells depths if it is so large a share of the depth; the nearest to the middle is taken.
_LEAST_BASELINE, _BEST_BASELINE, _MOST_BASELINE = 0.02, 0.1, 0.4


@dataclass(slots=True, eq=False)
class Study:
    """What is known of a robot: `keyframe` is the newest in use, `outlook` the newest that has a surface of its own.

    `pose` stands for the keyframe. `carried` is what the robot saw before it.
    """

    keyframe: Keyframe
    pose: Pose
    outlook: Outlook | None = None
    carried: Carried | None = None
    beside: dict[KeyframeId, Observations] = field(default_factory=dict)
    earlier: deque[Keyframe] = field(default_factory=lambda: deque(maxlen=_WINDOW))

    @property
    def as_reported(self) -> bool:
        """Does the keyframe's pose stand as it was reported?"""
        return self.pose is self.keyframe.pose

    def find(self, name: KeyframeId) -> Keyframe | None:
        """The keyframe of this name, if it is still held."""
        return next((one for one in (self.keyframe, *self.earlier) if one.id == name), None)

    def pose_of(self, keyframe: Keyframe) -> Pose:
        """The pose that stands for a keyframe of this robot."""
        if self.keyframe.id == keyframe.id:
            return self.pose
        held = self.outlook
        return held.pose if held is not None and held.keyframe.id == keyframe.id else keyframe.pose

    def surface_of(self, keyframe: Keyframe) -> Surface | None:
        """A keyframe's own surface, if it has one."""
        held = self.outlook
        return held.surface if held is not None and held.keyframe.id == keyframe.id else None

    def carry(self, surface: Surface, seen: Keyframe) -> None:
        """Let what an earlier keyframe shows fill what the newest does not tell."""
        self.carried = Carried(surface, seen.camera, *relative(seen.pose, self.keyframe.pose))

    def lay_beside(self, name: KeyframeId, said: Observations) -> None:
        """Keep depths that a replaced keyframe has given."""
        if len(said):
            self.beside[name] = said
            while len(self.beside) > _BESIDE:
                del self.beside[next(iter(self.beside))]

    def partner(self) -> Keyframe | None:
        """The earlier keyframe whose place gives the newest the best parallax, None if all are too near or too far."""
        if self.outlook is None:
            return None
        best: tuple[float, Keyframe] | None = None
        for other in self.earlier:
            apart_m = float(np.linalg.norm(other.pose.centre_m - self.keyframe.pose.centre_m))
            baseline = apart_m / self.outlook.depths_m[1]
            off = abs(np.log(max(baseline, _LEAST_BASELINE / 2) / _BEST_BASELINE))
            if _LEAST_BASELINE <= baseline <= _MOST_BASELINE and (best is None or off < best[0]):
                best = (off, other)
        return None if best is None else best[1]
