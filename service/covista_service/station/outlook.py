"""A keyframe with its surface, and what its robot has before it from where it stands now."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from covista_service.perception.camera import Pose, View, relative
from covista_service.perception.surface import Surface
from covista_service.perception.visibility import Mask, Seeing, VisibilityOptions, seen
from covista_service.station.events import Keyframe, KeyframeId

# Least and greatest ratio of the scales of two keyframes' depths.
Ratios = tuple[float, float]
Depths = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """A keyframe, the pose that stands for it, its surface, and how many points of its own that rests on.

    `matched`: keyframes that share matched points with it, and how many. `depths_m`: how near its surface is (5 %), its
    median and how far (95 %). `since_ns`: when the keyframe first had a surface.
    """

    keyframe: Keyframe
    pose: Pose
    surface: Surface
    points: int
    matched: Mapping[KeyframeId, int]
    depths_m: Depths
    since_ns: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Prospect:
    """What a robot sees from where it stood at `time_ns` (sensor time): `pose` as it stands, and the surface there.

    `source` is the last outlook with a surface of its own, which all this rests on; `outlook` is that of the robot's
    newest keyframe, by the same surface if it has none yet. `reported` is the pose as it was told.
    """

    source: Outlook
    outlook: Outlook
    reported: Pose
    pose: Pose
    surface: Surface
    time_ns: int

    @classmethod
    def of(cls, outlook: Outlook, source: Outlook | None = None) -> Prospect:
        """What an outlook's own keyframe sees."""
        keyframe = outlook.keyframe
        return cls(source or outlook, outlook, keyframe.pose, outlook.pose, outlook.surface, keyframe.time_ns)

    @property
    def robot(self) -> str:
        """Whose it is."""
        return self.outlook.keyframe.id.robot

    @property
    def still(self) -> bool:
        """Is it what the source's own image shows?"""
        return self.surface is self.source.surface


def stands(outlook: Outlook, reported: Pose) -> Pose:
    """The pose that stands for one that the same robot has reported: an outlook's correction moves along with it.

    P_now' = P_settled P_reported^-1 P_now: the motion since the keyframe is trusted.
    """
    before = outlook.keyframe.pose
    if outlook.pose is before:
        return reported
    turned = outlook.pose.world_from_camera @ before.world_from_camera.T
    centre_m = outlook.pose.centre_m + turned @ (reported.centre_m - before.centre_m)
    return Pose(turned @ reported.world_from_camera, centre_m)


def view_of(keyframe: Keyframe, pose: Pose) -> View:
    """What the maths needs of a keyframe, at this pose. Raises ValueError while it has no features."""
    if keyframe.features is None:
        raise ValueError(f"{keyframe.id} has no features yet")
    return View(keyframe.camera, pose, keyframe.features)


def masks(first: Outlook, second: Outlook, ratios: Ratios) -> tuple[Mask, Mask]:
    """Which cells (ROWS, COLUMNS) of either image the other camera sees."""
    rotation, translation = relative(first.pose, second.pose)
    one, other = (Seeing(outlook.keyframe.camera, outlook.surface) for outlook in (first, second))
    options = VisibilityOptions()
    return (
        seen(one, other, rotation, translation, options, ratios=ratios),
        seen(other, one, rotation.T, -rotation.T @ translation, options, ratios=_inverse(ratios)),
    )


def depths_m(surface: Surface) -> Depths:
    """How near a surface is (5 %), its median depth and how far it is (95 %)."""
    near, median, far = 1.0 / np.percentile(surface.inverse_depth, (95, 50, 5))
    return float(near), float(median), float(far)


def _inverse(ratios: Ratios) -> Ratios:
    return 1 / ratios[1], 1 / ratios[0]
