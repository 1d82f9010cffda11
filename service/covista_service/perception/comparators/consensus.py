"""Matches that one fundamental matrix explains, found without any knowledge of the cameras."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Floats

# Seven points determine a fundamental matrix, and say nothing about it; OpenCV asks for eight.
_LEAST = 8


@dataclass(frozen=True, slots=True)
class ConsensusOptions:
    """RANSAC: a match may lie `side_share` of the larger image side off its epipolar line."""

    side_share: float = 0.006
    confidence: float = 0.999
    iterations: int = 2048
    seed: int = 0


def consensus(first_px: Floats, second_px: Floats, larger_side_px: int, options: ConsensusOptions) -> NDArray[np.bool_]:
    """Which matches (k,) of points (k, 2) the best fundamental matrix explains: none where there is no such matrix."""
    none = np.zeros(len(first_px), np.bool_)
    if len(first_px) < _LEAST:
        return none
    params = cv2.UsacParams()
    params.score = cv2.SCORE_METHOD_RANSAC
    params.loMethod = cv2.LOCAL_OPTIM_INNER_LO
    params.confidence = options.confidence
    params.threshold = options.side_share * larger_side_px
    params.maxIterations = options.iterations
    params.randomGeneratorState = options.seed
    one, other = (np.ascontiguousarray(points, np.float64) for points in (first_px, second_px))
    try:
        matrix, mask = cv2.findFundamentalMat(one, other, params)
    except cv2.error:  # no model fits degenerate matches
        return none
    if matrix is None or mask is None or len(mask) != len(none):
        return none
    return np.asarray(mask.ravel() > 0, np.bool_)
