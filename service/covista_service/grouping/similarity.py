"""How close, and how alike: Eqs. 15 and 16 as functions of matrices."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Sigma = Literal["std"] | float
# Distances that differ by less than this share of their mean differ by rounding alone.
_EQUAL = 1e-9


def sigma_m(distance_m: Floats, sigma: Sigma) -> float:
    """The range of Eq. 15 in metres: as given, or the standard deviation of the N(N - 1)/2 distances (N, N).

    Their mean where all are equal (two robots, an equilateral triangle), and 1 where all are 0. Computed afresh from
    the matrix: a running sum of squares loses the spread of a tight swarm that has been far apart before.
    """
    if sigma != "std":
        return sigma
    count = len(distance_m)
    if count < 2:
        return 1.0
    mean = float(distance_m.sum()) / (count * (count - 1))
    if mean == 0:
        return 1.0
    deviation = distance_m - mean
    np.fill_diagonal(deviation, 0.0)
    spread = float(np.sqrt(np.vdot(deviation, deviation) / (count * (count - 1))))
    return spread if spread > _EQUAL * mean else mean


def closeness(distance_m: Floats, sigma: Sigma) -> Floats:
    """d_ij = exp(-|r_i - r_j|^2 / sigma^2), Eq. 15, for distances (N, N)."""
    result: Floats = np.exp(-np.square(distance_m / sigma_m(distance_m, sigma)))
    return result


def similarity(overlap: Floats, near: Floats, alpha: float) -> Floats:
    """s_ij = alpha (q_ij + q_ji)/2 + (1 - alpha) d_ij, Eq. 16, with s_ii = 1.

    Where the overlap is unknown (NaN) distance alone speaks: taken for 0 it would part robots that nobody has
    compared yet.
    """
    mutual = (overlap + overlap.T) / 2
    result: Floats = np.where(np.isnan(mutual), near, alpha * mutual + (1 - alpha) * near)
    np.fill_diagonal(result, 1.0)
    return result
