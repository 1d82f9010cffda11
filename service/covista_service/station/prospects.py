"""What two keyframes may have in common before their images are compared: poses and depths alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from covista_service.perception import frustum
from covista_service.perception.camera import Floats
from covista_service.perception.frustum import Frustum
from covista_service.station.events import Keyframe, KeyframeId

_LEAST_POINTS = 8
# Matched points show the textured part of a scene only: nearer and farther surfaces may be there.
_NEARER, _FARTHER = 0.3, 3.0
# What is left of a prediction when the images were compared and did not match: something may stand between, or the
# same place look another way. In rendered worlds anything from a quarter to a half halves the error of such pairs.
UNMATCHED = 0.5


@dataclass(frozen=True, slots=True)
class Depth:
    """How deep a robot's scene is, by the matched points of a survey of `keyframe`; metres along the optical axis."""

    keyframe: KeyframeId
    points: int
    near_m: float
    median_m: float
    far_m: float


def depth_of(keyframe: KeyframeId, depths_m: Floats) -> Depth | None:
    """The depth of a keyframe from its points' depths (k,), None if there are too few."""
    if len(depths_m) < _LEAST_POINTS:
        return None
    near, median, far = np.percentile(depths_m, (5, 50, 95))
    if near <= 0:
        return None
    return Depth(keyframe, len(depths_m), float(near), float(median), float(far))


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """What a keyframe can see, as far as is known. Built once, for it costs more than to hold it against another."""

    keyframe: Keyframe
    depth: Depth | None
    frustum: Frustum

    @classmethod
    def of(cls, keyframe: Keyframe, depth: Depth | None) -> Reach:
        """Unknown depths reach to infinity."""
        return cls(keyframe, depth, Frustum(keyframe.camera, keyframe.pose, _range_m(depth)))

    def is_of(self, keyframe: Keyframe, depth: Depth | None) -> bool:
        """Is it that of this keyframe and depth, or outdated?"""
        return self.keyframe is keyframe and self.depth == depth


def predict(first: Keyframe, first_depth: Depth, second: Keyframe, second_depth: Depth) -> tuple[float, float]:
    """q_1 and q_2 if each image showed a plane at its median depth."""
    return frustum.overlap(
        first.camera, first.pose, first_depth.median_m, second.camera, second.pose, second_depth.median_m
    )


def _range_m(depth: Depth | None) -> tuple[float, float]:
    return (0.0, math.inf) if depth is None else (_NEARER * depth.near_m, _FARTHER * depth.far_m)
