"""How well the scale of depths is known: by reported baselines, and the longer they are the better."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from covista_service.perception.camera import Floats

# Beyond e^9 either way any ratio will do.
_ANY = 9.0


def parts_of(count: int, joined: Sequence[tuple[int, int]]) -> NDArray[np.int64]:
    """The part (count,) that each keyframe belongs to: those of one part are `joined` by matches, if by way of others.

    Their depths have one scale.
    """
    ends = np.array(joined, np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(ends), np.int64), (ends[:, 0], ends[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def scale_sigmas(centres_m: Floats, depths_m: Floats, parts: NDArray[np.int64], position_share: float) -> Floats:
    """By what factor exp(+-sigma) the depths of each keyframe (n,) may be off, all of a part by the same.

    The scale of a part is that of its centres (n, 3), each known to within `position_share` of the median depth: fitted
    to them it has the relative variance sigma^2 / sum |C - mean C|^2. `depths_m` (n,), NaN where unknown, as in a part
    without a spread: there any factor will do.
    """
    sigmas = np.full(len(parts), _ANY)
    for part in np.unique(parts):
        members = parts == part
        known = depths_m[members & np.isfinite(depths_m)]
        spread = float(np.linalg.norm(centres_m[members] - centres_m[members].mean(axis=0)))
        if len(known) and spread > 0:
            sigmas[members] = min(position_share * float(np.median(known)) / spread, _ANY)
    return sigmas


def ratio_range(one_sigma: float, other_sigma: float, sigmas: float) -> tuple[float, float]:
    """Least and greatest ratio of the scales of two parts, `sigmas` of them off."""
    room = min(sigmas * float(np.hypot(one_sigma, other_sigma)), _ANY)
    return float(np.exp(-room)), float(np.exp(room))
