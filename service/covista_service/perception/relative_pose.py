"""The relative pose of two cameras: what was reported, unless the images know better."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Floats
from covista_service.perception.epipolar import fundamental, homogeneous, residuals, transfer_errors
from covista_service.perception.pose_refinement import PosePrior, refine
from covista_service.perception.sightings import Sightings
from covista_service.perception.triangulation import TriangulationOptions, triangulate

PoseSource = Literal["reported", "images"]
Mask = NDArray[np.bool_]

# Two robots that report the very same place, though the images show parallax: any length will do, the overlap does
# not depend on it (section II-C).
_NOMINAL_BASELINE_M = 1.0
_NO_BASELINE_M = 1e-9


@dataclass(frozen=True, slots=True)
class RelativePoseOptions:
    """`inlier_px`: a match within this Sampson error supports a pose.

    A pose is `verified` by at least `min_inliers` and `min_share` of the matches. The reported pose stands if it holds
    `keep_share` of the inliers of the best estimate. `rotation_deg` and `direction` (chord on the unit sphere) say how
    far reported poses are off: weak priors that matter where the images cannot say.
    """

    inlier_px: float = 2.0
    min_inliers: int = 8
    min_share: float = 0.25
    keep_share: float = 0.9
    rotation_deg: float = 3.0
    direction: float = 0.15
    ransac_px: float = 1.5
    ransac_iterations: int = 300


@dataclass(frozen=True, slots=True, eq=False)
class RelativePose:
    """X_2 = R X_1 + t; `inliers` (n,) are the matches that agree, `source` says who knew."""

    rotation: Floats
    translation: Floats
    source: PoseSource
    inliers: Mask
    verified: bool


def relative_pose(
    sightings: Sightings, rotation: Floats, translation: Floats, options: RelativePoseOptions, seed: int
) -> RelativePose:
    """Judge the reported pose (R, t) by the images, and put a better one in its place if there is one.

    The baseline's length is always the reported one. Where the images cannot say, the reported pose stands.
    """
    reported = _supporters(sightings, rotation, translation, options.inlier_px)
    needed = max(options.min_inliers, options.min_share * len(reported))
    stands = _facing(sightings, rotation, translation, reported)
    as_reported = RelativePose(rotation, translation, "reported", reported, bool(stands and reported.sum() >= needed))
    # No estimate can have more inliers than there are matches.
    if len(reported) < options.min_inliers or (stands and reported.mean() >= options.keep_share):
        return as_reported
    estimate = _estimated(sightings, rotation, translation, options, seed)
    if estimate is None:
        return as_reported
    inliers = _supporters(sightings, *estimate, options.inlier_px)
    if inliers.sum() < needed or (stands and reported.sum() >= options.keep_share * inliers.sum()):
        return as_reported
    return RelativePose(*estimate, "images", inliers, True)


def _supporters(sightings: Sightings, rotation: Floats, translation: Floats, inlier_px: float) -> Mask:
    """Matches (n,) that agree with a pose; without a baseline only far points can."""
    one, other = homogeneous(sightings.first_px), homogeneous(sightings.second_px)
    if np.linalg.norm(translation) < _NO_BASELINE_M:
        return transfer_errors(sightings.first, sightings.second, rotation, one, other) < inlier_px
    F = fundamental(sightings.first, sightings.second, rotation, translation)
    return np.abs(residuals(F, one, other)[0]) < inlier_px


def _estimated(
    sightings: Sightings, rotation: Floats, translation: Floats, options: RelativePoseOptions, seed: int
) -> tuple[Floats, Floats] | None:
    """The best pose that starts from the reported one or from MAGSAC lead to, with the reported length."""
    length = float(np.linalg.norm(translation))
    prior = PosePrior(rotation, translation / length if length > _NO_BASELINE_M else None)
    prior = prior.weighted(np.radians(options.rotation_deg), options.direction)
    starts = [] if prior.direction is None else [(rotation, prior.direction)]
    starts += _sampled(sightings, options, seed)
    one, other = homogeneous(sightings.first_px), homogeneous(sightings.second_px)
    refined = [refine(sightings.first, sightings.second, one, other, *start, prior) for start in starts]
    if not refined:
        return None
    best = min(refined, key=lambda estimate: estimate.cost)
    towards = best.direction * (length if length > _NO_BASELINE_M else _NOMINAL_BASELINE_M)
    # Epipolar lines are blind to the sign of t.
    inliers = _supporters(sightings, best.rotation, towards, options.inlier_px)
    facing = _facing(sightings, best.rotation, towards, inliers)
    return best.rotation, towards if facing else -towards


def _sampled(sightings: Sightings, options: RelativePoseOptions, seed: int) -> list[tuple[Floats, Floats]]:
    """The pose (R, unit t) that MAGSAC finds among the matches, if any."""
    params = cv2.UsacParams()
    params.score = cv2.SCORE_METHOD_MAGSAC
    params.loMethod = cv2.LOCAL_OPTIM_SIGMA
    params.confidence = 0.999
    params.threshold = options.ransac_px
    params.maxIterations = options.ransac_iterations
    params.randomGeneratorState = seed
    first, second = sightings.first.matrix, sightings.second.matrix
    one, other = np.ascontiguousarray(sightings.first_px), np.ascontiguousarray(sightings.second_px)
    try:
        essential, mask = cv2.findEssentialMat(one, other, first, second, None, None, params)
    except cv2.error:  # no model fits degenerate matches
        return []
    if essential is None or essential.shape != (3, 3) or not np.isfinite(essential).all():
        return []
    return [_decomposed(sightings, np.asarray(essential, np.float64), mask.ravel() > 0)]


def _decomposed(sightings: Sightings, essential: Floats, inliers: Mask) -> tuple[Floats, Floats]:
    """The one of the four poses (R, t) of an essential matrix that puts most inliers in front of both cameras."""
    one, other, t = cv2.decomposeEssentialMat(essential)
    direction = np.asarray(t, np.float64)[:, 0]
    poses = [(np.asarray(R, np.float64), sign * direction) for R in (one, other) for sign in (1.0, -1.0)]
    return max(poses, key=lambda pose: _in_front(sightings, pose[0], pose[1], inliers))


def _facing(sightings: Sightings, rotation: Floats, translation: Floats, inliers: Mask) -> bool:
    """Do at least as many points lie in front of both cameras as with the opposite baseline?"""
    there = _in_front(sightings, rotation, translation, inliers)
    return there >= _in_front(sightings, rotation, -translation, inliers)


def _in_front(sightings: Sightings, rotation: Floats, translation: Floats, chosen: Mask) -> int:
    """Number of chosen matches whose point lies in front of both cameras with parallax that is not mere noise."""
    within = TriangulationOptions(reprojection_px=np.inf)
    points = triangulate(sightings.only(chosen), rotation, translation, within)
    return int((points.kept & (points.parallax_px > 1.0)).sum())
