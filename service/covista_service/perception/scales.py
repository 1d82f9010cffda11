"""How well the scale of depths is known: by reported baselines, and the longer they are the better."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats

# Beyond e^9 either way any ratio will do.
_ANY = 9.0


def parts_of(count: int, joined: Sequence[tuple[int, int]]) -> NDArray[np.int64]:
    """The part (count,) that each keyframe belongs to: those of one part are `joined` by matches, if by way of others.

    Their depths have one scale.
    """
    return _parts(count, np.array(joined, np.int64).reshape(-1, 2))


def scale_sigmas(centres_m: Floats, depths_m: Floats, parts: NDArray[np.int64], position_share: float) -> Floats:
    """By what factor exp(+-sigma) the depths of each keyframe (n,) may be off, all of a part by the same.

    The scale of a part is that of its centres (n, 3), each known to within `position_share` of the median depth: fitted
    to them it has the relative variance sigma^2 / sum |C - mean C|^2. `depths_m` (n,), NaN where unknown, as in a part
    without a spread: there any factor will do.
    """
    count = int(parts.max()) + 1 if len(parts) else 0
    sizes = np.bincount(parts, minlength=count)
    means = np.column_stack([np.bincount(parts, axis, count) for axis in centres_m.T]) / np.maximum(sizes, 1)[:, None]
    spreads = np.sqrt(np.bincount(parts, ((centres_m - means[parts]) ** 2).sum(axis=1), count))
    medians = _medians(depths_m, parts, count)
    told = (spreads > 0) & np.isfinite(medians)
    sigmas = np.full(count, _ANY)
    sigmas[told] = np.minimum(position_share * medians[told] / spreads[told], _ANY)
    return sigmas[parts]


def _medians(values: Floats, parts: NDArray[np.int64], count: int) -> Floats:
    """Median (count,) of the finite values of each part, NaN where there are none."""
    finite = np.isfinite(values)
    values, parts = values[finite], parts[finite]
    ordered = values[np.lexsort((values, parts))]
    sizes = np.bincount(parts, minlength=count)
    starts, some = np.cumsum(sizes) - sizes, sizes > 0
    medians = np.full(count, np.nan)
    lower, upper = (starts + (sizes - 1) // 2)[some], (starts + sizes // 2)[some]
    medians[some] = (ordered[lower] + ordered[upper]) / 2
    return medians


def ratio_range(one_sigma: float, other_sigma: float, sigmas: float) -> tuple[float, float]:
    """Least and greatest ratio of the scales of two parts, `sigmas` of them off."""
    room = min(sigmas * float(np.hypot(one_sigma, other_sigma)), _ANY)
    return float(np.exp(-room)), float(np.exp(room))


@compiled
def _parts(count: int, joined: NDArray[np.int64]) -> NDArray[np.int64]:
    """Union and find; parts are numbered by their first members. A sparse graph takes a millisecond for a few ends."""
    above = np.arange(count)
    for k in range(len(joined)):
        one, other = joined[k]
        while above[one] != one:
            above[one] = above[above[one]]
            one = above[one]
        while above[other] != other:
            above[other] = above[above[other]]
            other = above[other]
        above[max(one, other)] = min(one, other)
    parts, number = np.empty(count, np.int64), 0
    for k in range(count):
        # What stands above comes before.
        if above[k] == k:
            parts[k] = number
            number += 1
        else:
            parts[k] = parts[above[k]]
    return parts
