"""The survey of a pair of keyframes: what do both cameras see?"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Floats, View


class Outcome(StrEnum):
    """What a survey came to. Only `measured` carries an overlap."""

    MEASURED = "measured"
    FEW_MATCHES = "few_matches"
    UNVERIFIED = "unverified"
    NO_PARALLAX = "no_parallax"
    NO_PLANE = "no_plane"
    KINDS_DIFFER = "kinds_differ"


PoseSource = Literal["reported", "images"]


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """u . X + 1 = 0 in the first camera's frame: `normal` u (3,), 1/m; region polygons (k, 2) px in both images."""

    normal: Floats
    support: int
    region_first: Floats
    region_second: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What a survey found; overlaps are q_1 and q_2 of Eq. 16, None unless measured.

    `rotation`, `translation`: X_2 = R X_1 + t as used. Points: inlier keypoints of both images (k, 2) in ideal px,
    with their depths Z (k,) in each camera, and the plane index (k,) of each, -1 for none.
    """

    outcome: Outcome
    overlap_first: float | None = None
    overlap_second: float | None = None
    matches: int = 0
    inliers: int = 0
    pose_source: PoseSource | None = None
    rotation: Floats = field(default_factory=lambda: np.eye(3))
    translation: Floats = field(default_factory=lambda: np.zeros(3))
    planes: tuple[Plane, ...] = ()
    points_first_px: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    points_second_px: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    depths_first: Floats = field(default_factory=lambda: np.zeros(0))
    depths_second: Floats = field(default_factory=lambda: np.zeros(0))
    plane_of_point: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))


@dataclass(frozen=True, slots=True)
class SurveyOptions:
    """Options of all stages."""

    seed: int = 0


def survey(first: View, second: View, options: SurveyOptions, prior: Survey | None = None) -> Survey:
    """Survey a pair of views."""
    raise NotImplementedError
