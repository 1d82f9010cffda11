"""Number of verified matches, over the features of the poorer image.

Snavely, Seitz, Szeliski, "Modeling the World from Internet Photo Collections", IJCV 80 (2008), section 4: SIFT, Lowe's
ratio, and a fundamental matrix by RANSAC; too few inliers make no edge between two images. Here RANSAC optimises
locally, and a match must also stand out seen from the second image, so that the two can be swapped.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.comparators.consensus import ConsensusOptions, consensus
from covista_service.perception.comparators.image import Image
from covista_service.perception.matching import MatchingOptions, match


@dataclass(frozen=True, slots=True)
class SnavelyOptions:
    """Below `least` inliers two images have nothing in common."""

    matching: MatchingOptions = field(default_factory=lambda: MatchingOptions(0.6, 0.6))
    consensus: ConsensusOptions = field(default_factory=ConsensusOptions)
    least: int = 20


DEFAULTS = SnavelyOptions()


def verified(first: Image, second: Image, options: SnavelyOptions = DEFAULTS) -> NDArray[np.intp]:
    """Matches (k, 2) that the epipolar geometry explains; none below `least`, or of features of different kinds."""
    if first.features.kind != second.features.kind:
        return np.zeros((0, 2), np.intp)
    matches = match(first.features, second.features, options.matching)
    one, other = first.features.keypoints_px[matches[:, 0]], second.features.keypoints_px[matches[:, 1]]
    side_px = max(first.larger_side_px, second.larger_side_px)
    inliers = matches[consensus(one.astype(np.float64), other.astype(np.float64), side_px, options.consensus)]
    return inliers if len(inliers) >= options.least else inliers[:0]


def similarity(inliers: int, first: Image, second: Image) -> float:
    """Inliers over the smaller number of features, from 0 to 1."""
    fewer = min(len(first.features.keypoints_px), len(second.features.keypoints_px))
    return inliers / fewer if fewer else 0.0
