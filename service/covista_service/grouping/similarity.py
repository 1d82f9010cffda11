"""How close, and how alike: Eqs. 15 and 16 as functions of matrices."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled

Floats = NDArray[np.float64]
Sigma = Literal["shared", "std"] | float
# Distances that differ by less than this share of their mean count as equal: below it the difference of the mean
# square and the squared mean is rounding.
EQUAL = 1e-6
# Ranges beyond count as these, so that squares are neither 0 nor infinite.
_TIGHTEST_M, _WIDEST_M = 1e-100, 1e100
# Who sees more than this in common with somebody tells how far apart robots of one group stand.
_SHARED = 0.25
_PARTNERS = 2
_REACH = 2.5
_REACH_OF_NEAREST = 6.0
# Up to so many links are looked at in turn, each for all robots at once.
_FEW = 20
# As near as the nearest, to rounding of squares.
_AS_NEAR = 1 + 1e-9


def sigma_m(distance_m: Floats, mutual: Floats, sigma: Sigma) -> float:
    """The range of Eq. 15 in metres, from distances and mutual overlaps (N, N; NaN unknown).

    A number is taken as given. `std`, as printed, is the standard deviation of the N(N - 1)/2 distances: their mean
    where all are equal (two robots, an equilateral triangle). It is the size of the arena, so in a large swarm
    everybody is close to everybody. `shared` is 2.5 times the median distance from a robot to the two that it has most
    in common with, of those who share more than a quarter. Where there are fewer than N/2 such partners, the nearest
    robots tell: if N/4 at least are known to share little with theirs, so far is too far, and it is half the median of
    those distances; else, with nothing known, 6 times the median distance to the nearest. Where that is 0, for most
    stand in one place, it is the mean distance, and 1 where all stand there.
    """
    if sigma == "shared":
        return shared_sigma_m(np.square(distance_m), mutual)
    return standard_sigma_m(distance_m) if sigma == "std" else check_sigma_m(sigma)


def check_sigma_m(sigma: float | str) -> float:
    """A range in metres as it is; ValueError for what is none."""
    # NaN is not more than anything.
    if isinstance(sigma, str) or not sigma > 0:
        raise ValueError(f"sigma is shared, std, or metres above 0, not {sigma!r}")
    return sigma


def check_alpha(alpha: float) -> None:
    """Raise ValueError for what is no weight of the overlap."""
    if not 0 <= alpha <= 1:
        raise ValueError(f"alpha lies from 0 to 1, not {alpha}")


def standard_sigma_m(distance_m: Floats) -> float:
    """The range of Eq. 15 as printed, by the standard deviation of distances (N, N): see `sigma_m`."""
    above = distance_m[np.triu_indices(len(distance_m), 1)]
    return spread_m(len(above), float(above.sum()), float(above @ above))


def spread_m(count: int, total_m: float, squares_m2: float) -> float:
    """The standard deviation of `count` distances from their sum and the sum of their squares, as Eq. 15 wants it.

    The difference loses digits only where the spread is small beside the mean; in three dimensions no more than four
    robots can be so, and then Eq. 15 is 0 to all digits.
    """
    if not count or total_m == 0:
        return 1.0
    mean = total_m / count
    variance = squares_m2 / count - mean * mean
    return float(np.sqrt(variance)) if variance > (EQUAL * mean) ** 2 else mean


def shared_sigma_m(squared_m2: Floats, mutual: Floats) -> float:
    """The range of Eq. 15 by those who see the same, from squared distances (N, N): see `sigma_m`."""
    count = len(squared_m2)
    if count < 2:
        return 1.0
    partners_m, nearest_m, strange = _companions(squared_m2, mutual)
    if 2 * len(partners_m) >= count:
        sigma = _REACH * float(np.median(partners_m))
    elif 4 * np.count_nonzero(strange) >= count:
        sigma = float(np.median(nearest_m[strange])) / 2
    else:
        sigma = _REACH_OF_NEAREST * float(np.median(nearest_m))
    if sigma == 0:
        # Most stand in one place.
        sigma = float(np.sqrt(squared_m2).mean())
    return sigma or 1.0


def closeness(distance_m: Floats, sigma_m: float) -> Floats:
    """d_ij = exp(-|r_i - r_j|^2 / sigma^2), Eq. 15, for distances (N, N)."""
    result: Floats = np.exp(-np.square(distance_m / _within(sigma_m)))
    return result


def mutual_overlap(overlap: Floats) -> Floats:
    """(q_ij + q_ji)/2 for overlaps (N, N); NaN where one of the two is unknown."""
    result: Floats = (overlap + overlap.T) / 2
    return result


def similarity(mutual: Floats, squared_m2: Floats, alpha: float, sigma_m: float) -> Floats:
    """s_ij = alpha (q_ij + q_ji)/2 + (1 - alpha) d_ij, Eq. 16, with s_ii = 1.

    From mutual overlaps (N, N) and squared distances (N, N), m^2. An unknown overlap (NaN) is not zero overlap: it is
    what the best chain over a third robot passes on, the product of the two mutual overlaps that are known, of which
    one at least is more than a quarter: who sees nothing of what a companion of mine sees will see little of mine.
    Where there is no such link, distance alone speaks. Raises ValueError for an alpha that is none.
    """
    check_alpha(alpha)
    S = np.empty_like(squared_m2)
    _mix(squared_m2, mutual, alpha, _within(sigma_m) ** 2, S)
    return S


def matrix(distance_m: Floats, overlap: Floats, alpha: float, sigma: Sigma) -> Floats:
    """Eqs. 15 and 16 from distances and overlaps (N, N; row i: share of i's image seen by j; NaN unknown).

    Raises ValueError for what is no such matrix, alpha or sigma.
    """
    distance_m, overlap = np.asarray(distance_m, np.float64), np.asarray(overlap, np.float64)
    count = len(distance_m)
    if distance_m.shape != (count, count) or overlap.shape != distance_m.shape:
        raise ValueError(f"distances and overlaps are square and of one size, not {distance_m.shape}, {overlap.shape}")
    if not (np.isfinite(distance_m) & (distance_m >= 0)).all():
        raise ValueError("distances are finite and not below 0")
    if not (np.isnan(overlap) | ((overlap >= 0) & (overlap <= 1))).all():
        raise ValueError("an overlap lies from 0 to 1, or is NaN where unknown")
    mutual = mutual_overlap(overlap)
    return similarity(mutual, np.square(distance_m), alpha, sigma_m(distance_m, mutual, sigma))


def _within(sigma_m: float) -> float:
    return min(max(sigma_m, _TIGHTEST_M), _WIDEST_M)


@compiled
def _companions(squared_m2: Floats, mutual: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Distances of everybody's two partners, those who share enough; and how far everybody's nearest robot is (N,).

    And whether the two are known to share little, (N,): whoever of those as near it is.
    """
    count = len(squared_m2)
    partners, found = np.empty(_PARTNERS * count), 0
    nearest, strange = np.empty(count), np.empty(count, np.bool_)
    for i in range(count):
        first, second, one, other = _SHARED, _SHARED, -1, -1
        for j in range(count):
            if j == i:
                continue
            square, q = squared_m2[i, j], mutual[i, j]
            # So it is with nearly all, and where the overlap is unknown.
            if not q >= second:
                continue
            # Of equals the nearer counts, whatever their order.
            if q > first or (q == first and one >= 0 and square < squared_m2[i, one]):
                second, other, first, one = first, one, q, j
            elif q > second or (other >= 0 and square < squared_m2[i, other]):
                second, other = q, j
        for partner in (one, other):
            if partner >= 0:
                partners[found] = squared_m2[i, partner]
                found += 1
        nearest[i], strange[i] = _nearest(squared_m2[i], mutual[i], i)
    return np.sqrt(partners[:found]), np.sqrt(nearest), strange


@compiled
def _nearest(squared_m2: Floats, mutual: Floats, i: int) -> tuple[float, bool]:
    """How far robot i's nearest is, squared, by squared distances and mutual overlaps (N,); do they share little?"""
    near = np.inf
    for j in range(len(squared_m2)):
        if j != i:
            near = min(near, squared_m2[j])
    for j in range(len(squared_m2)):
        if j != i and squared_m2[j] <= _AS_NEAR * near and not mutual[j] <= _SHARED:
            return near, False
    return near, True


@compiled
def _mix(squared_m2: Floats, mutual: Floats, alpha: float, sigma2_m2: float, S: Floats) -> None:
    """Fill S: Eqs. 15 and 16 in one pass over one half, and what is unknown by chains."""
    count = len(squared_m2)
    known_everything = True
    for i in range(count):
        S[i, i] = 1.0
        for j in range(i):
            near = np.exp(-squared_m2[i, j] / sigma2_m2)
            q = mutual[i, j]
            if np.isnan(q):
                known_everything = False
                S[i, j] = near
            else:
                S[i, j] = alpha * q + (1 - alpha) * near
            S[j, i] = S[i, j]
    if not known_everything:
        _chain(mutual, alpha, S)


@compiled
def _chain(mutual: Floats, alpha: float, S: Floats) -> None:
    """Where the overlap is unknown S holds d_ij: mix in what the best link passes on, where there is one."""
    count = len(mutual)
    begin, links = _links(mutual)
    best = np.empty(count)
    for i in range(count):
        best[:] = -1.0
        _pass_on(mutual, i, links[begin[i] : begin[i + 1]], best)
        for j in range(count):
            if np.isnan(mutual[i, j]):
                if j > i:
                    # Kept until it is the turn of row j and its links.
                    S[i, j] = best[j]
                else:
                    q = max(best[j], S[j, i])
                    if q >= 0:
                        S[i, j] = alpha * q + (1 - alpha) * S[i, j]
                    S[j, i] = S[i, j]


@compiled
def _pass_on(mutual: Floats, i: int, links: NDArray[np.int64], best: Floats) -> None:
    """What links of robot i, the best first, pass on at most to those whose overlap is unknown, if they do: (N,)."""
    if len(links) <= _FEW:
        # Line by line: of many robots who see little of each other most is unknown.
        for k in links:
            for j in range(len(best)):
                # False where the second step is unknown.
                if mutual[i, k] * mutual[k, j] > best[j]:
                    best[j] = mutual[i, k] * mutual[k, j]
        return
    for j in range(len(best)):
        if np.isnan(mutual[i, j]):
            for k in links:
                # The rest passes on less, for nobody shares more than everything.
                if mutual[i, k] <= best[j]:
                    break
                if mutual[i, k] * mutual[j, k] > best[j]:
                    best[j] = mutual[i, k] * mutual[j, k]


@compiled
def _links(mutual: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """With whom robots share enough, the most first: `links[begin[i]:begin[i + 1]]` of robot i."""
    count = len(mutual)
    begin = np.zeros(count + 1, np.int64)
    for i in range(count):
        found = 0
        for j in range(count):
            found += mutual[i, j] > _SHARED
        # Not itself.
        begin[i + 1] = begin[i] + found - (mutual[i, i] > _SHARED)
    links = np.empty(begin[count], np.int64)
    for i in range(count):
        found = begin[i]
        for j in range(count):
            if j != i and mutual[i, j] > _SHARED:
                links[found] = j
                found += 1
        own = links[begin[i] : begin[i + 1]]
        own[:] = own[np.argsort(-mutual[i][own], kind="mergesort")]
    return begin, links
