"""What the images of one pair alone say: which keypoints match, and the relative pose that the matches support."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.adjustment import Link
from covista_service.perception.camera import View, relative, undistort
from covista_service.perception.matching import MatchingOptions, match
from covista_service.perception.relative_pose import RelativePose, RelativePoseOptions, relative_pose
from covista_service.perception.sightings import Sightings


class Outcome(StrEnum):
    """What comparing the images of a pair, or surveying its planes, came to. `measured` carries planes and an overlap.

    `no_parallax` carries no planes, and an overlap if all points are where far ones would be: then depth is no matter.
    """

    MEASURED = "measured"
    FEW_MATCHES = "few_matches"
    UNVERIFIED = "unverified"
    NO_PARALLAX = "no_parallax"
    NO_PLANE = "no_plane"
    KINDS_DIFFER = "kinds_differ"


@dataclass(frozen=True, slots=True)
class ComparisonOptions:
    """Options of both steps; `seed` of the sampling of poses. `min_matches`: with fewer, nothing can be verified."""

    seed: int = 0
    min_matches: int = 8
    matching: MatchingOptions = field(default_factory=lambda: MatchingOptions(rootsift_ratio=0.8))
    pose: RelativePoseOptions = field(default_factory=RelativePoseOptions)


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """`matches` (k, 2) keypoint indices, the same points in ideal px, and the pose that they support.

    `comparable`: whether the features are of one kind; none match otherwise. `enough`: whether so many match that they
    can verify a pose.
    """

    comparable: bool
    matches: NDArray[np.int64]
    sightings: Sightings
    pose: RelativePose
    enough: bool = True

    @property
    def outcome(self) -> Outcome:
        """`measured` if images verify the pair: depths, and so an overlap, can be told from them."""
        if not self.comparable:
            return Outcome.KINDS_DIFFER
        if not self.enough:
            return Outcome.FEW_MATCHES
        return Outcome.MEASURED if self.pose.verified else Outcome.UNVERIFIED

    @property
    def link(self) -> Link | None:
        """What adjusting poses together needs of the pair, if its images verify it."""
        if not self.pose.verified:
            return None
        contradicts = self.pose.source == "images"
        return Link(self.matches[self.pose.inliers], self.pose.rotation, self.pose.translation, contradicts)


def compare(first: View, second: View, options: ComparisonOptions) -> Comparison:
    """Match two keyframes, and judge the relative pose that was reported."""
    comparable = first.features.kind == second.features.kind
    matches = np.zeros((0, 2), np.int64)
    if comparable:
        matches = match(first.features, second.features, options.matching).astype(np.int64)
    sightings = sighted(first, second, matches)
    reported = relative(first.pose, second.pose)
    pose = relative_pose(sightings, *reported, options.pose, options.seed)
    return Comparison(comparable, matches, sightings, pose, len(matches) >= options.min_matches)


def sighted(first: View, second: View, matches: NDArray[np.int64]) -> Sightings:
    """Matches (k, 2) of two keyframes, lens distortion taken out."""
    return Sightings(
        first.camera,
        second.camera,
        undistort(first.camera, first.features.keypoints_px[matches[:, 0]]),
        undistort(second.camera, second.features.keypoints_px[matches[:, 1]]),
    )
