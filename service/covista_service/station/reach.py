"""What a keyframe can see, as far as is known: cut at the depths of its scene, grown by the doubt about its pose."""

from __future__ import annotations

import math
from dataclasses import dataclass

from covista_service.perception.extent import Box, Doubt, box_of
from covista_service.perception.frustum import Frustum
from covista_service.station.corrections import Correction
from covista_service.station.events import Keyframe, KeyframeId
from covista_service.station.outlook import Outlook

_LEAST_POINTS = 8
# Matched points show the textured part of a scene only: nearer and farther surfaces may be there.
_NEARER, _FARTHER = 0.3, 3.0


@dataclass(frozen=True, slots=True)
class Depth:
    """How deep a robot's scene is, by the surface of `keyframe`; metres along the optical axis."""

    keyframe: KeyframeId
    points: int
    near_m: float
    median_m: float
    far_m: float


def depth_of(outlook: Outlook) -> Depth | None:
    """The depth of a keyframe by its surface, None if that rests on too few points of its own."""
    if outlook.points < _LEAST_POINTS:
        return None
    return Depth(outlook.keyframe.id, outlook.points, *outlook.depths_m)


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """A frustum in the world and the box around it. Built once, for it costs more than to hold it against another."""

    keyframe: Keyframe
    depth: Depth | None
    frustum: Frustum
    box: Box

    @classmethod
    def of(
        cls, keyframe: Keyframe, depth: Depth | None, farthest_m: float = math.inf, correction: Correction | None = None
    ) -> Reach:
        """While its depth is not known a view reaches to `farthest_m`; a `correction` tells how far poses are off."""
        doubt = _doubt(keyframe.doubt, correction)
        near_m, far_m = (0.0, farthest_m) if depth is None else (_NEARER * depth.near_m, _FARTHER * depth.far_m)
        off_m = min(doubt.off_m(0.0 if depth is None else depth.median_m), far_m)
        frustum = Frustum(keyframe.camera, keyframe.pose, (near_m, far_m), doubt.angle_rad, off_m)
        return cls(keyframe, depth, frustum, box_of(frustum.corners, frustum.directions, off_m))

    def is_of(self, keyframe: Keyframe, depth: Depth | None) -> bool:
        """Is it that of this keyframe and depth, or outdated?"""
        return self.keyframe is keyframe and self.depth == depth

    @property
    def endless(self) -> bool:
        """Does it reach to infinity?"""
        return bool(self.frustum.directions.any())


def farthest_m(depth: Depth) -> float:
    """How far a view of this depth may reach."""
    return _FARTHER * depth.far_m


def _doubt(reported: Doubt, correction: Correction | None) -> Doubt:
    if correction is None:
        return reported
    return reported.at_least(math.radians(correction.deg), correction.m)
