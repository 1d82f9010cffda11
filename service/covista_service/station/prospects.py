"""What two keyframes have in common, by their outlooks, and whether it is worth comparing their images."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from covista_schemas.reports import FoundBy

from covista_service.perception.frustum import Frustum
from covista_service.station.events import Keyframe, KeyframeId
from covista_service.station.outlooks import Outlook, masks
from covista_service.station.pairs import Answer

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
    near, median, far = np.percentile(1.0 / outlook.surface.inverse_depth, (5, 50, 95))
    return Depth(outlook.keyframe.id, outlook.points, float(near), float(median), float(far))


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


def read(first: Outlook, second: Outlook, now_ns: int, connected: bool) -> Answer:
    """The overlap of two outlooks: by image where their keyframes share matched points, else predicted.

    `connected`: whether matches connect the two at least by way of others, so that their depths have one scale.
    """
    matched = second.keyframe.id in first.matched or first.keyframe.id in second.matched
    shares = [float(mask.mean()) for mask in masks(first, second, connected=connected or matched)]
    found_by = FoundBy.IMAGE if matched else FoundBy.PREDICTED
    return Answer(
        (shares[0], shares[1]), found_by, now_ns, first.keyframe, second.keyframe, (first, second), connected=connected
    )


def _range_m(depth: Depth | None) -> tuple[float, float]:
    return (0.0, math.inf) if depth is None else (_NEARER * depth.near_m, _FARTHER * depth.far_m)
