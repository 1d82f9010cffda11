"""What a keyframe's pairs agree on: depths of its keypoints, merged and sifted.

Wrong points ruin a surface, not the interpolation between right ones. So a depth counts in full only where two pairs
tell the same, and one that was seen once must fit its neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats
from covista_service.perception.nearest import nearest

Mask = NDArray[np.bool_]
AGREED, SINGLE, CONTRADICTED = 1.0, 0.4, 0.1
# Of points that an earlier keyframe of the same robot has seen.
CARRIED = 0.1


@dataclass(frozen=True, slots=True)
class AgreementOptions:
    """Two inverse depths agree within `sigmas` sigma and `tolerance` of themselves.

    A point that was seen once stays if enough of its `neighbours` within `reach` image widths, weighted by confidence
    and nearness (softened by `softening` widths), agree with it: `support_free` if its match was found without the
    geometry, else `support_guided`. A keypoint that is there twice, within `apart_px`, is no neighbour of itself. Only
    where at least `least_agreed` keypoints, and that share of all, are agreed: else singles are all there is.
    """

    tolerance: float = 0.03
    sigmas: float = 3.0
    neighbours: int = 8
    reach: float = 0.2
    softening: float = 0.03
    apart_px: float = 0.5
    support_tolerance: float = 0.10
    support_sigmas: float = 2.0
    support_free: float = 0.4
    support_guided: float = 0.5
    least_agreed: int = 20
    least_agreed_share: float = 0.15


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """Depths that one pair gives one keyframe.

    `keypoints` (n,) indices, `inverse_depths` (n,) 1/m, their `sigmas` (n,), and `free` (n,): whether the match was
    found without the help of the geometry.
    """

    keypoints: NDArray[np.int64]
    inverse_depths: Floats
    sigmas: Floats
    free: Mask

    def __len__(self) -> int:
        return len(self.keypoints)

    def only(self, chosen: Mask) -> Observations:
        """Those where `chosen` (n,) is true."""
        return Observations(*(getattr(self, name)[chosen] for name in self.__slots__))


@dataclass(frozen=True, slots=True, eq=False)
class DepthPoints:
    """Points of an image with a depth: `positions_px` (n, 2), `inverse_depths`, `sigmas`, `confidences` (n,)."""

    positions_px: Floats
    inverse_depths: Floats
    sigmas: Floats
    confidences: Floats

    def __len__(self) -> int:
        return len(self.positions_px)

    def beside(self, others: DepthPoints) -> DepthPoints:
        """These and others."""
        return DepthPoints(*(np.concatenate((getattr(self, name), getattr(others, name))) for name in self.__slots__))


def agree(
    observations: Sequence[Observations],
    keypoints_px: Floats,
    width_px: int,
    options: AgreementOptions,
    known: DepthPoints | None = None,
) -> DepthPoints:
    """Merge what all pairs of a keyframe say of its keypoints (k, 2), and drop singles that nothing supports.

    `known` points of the same image, from elsewhere, support singles or speak against them.
    """
    if not any(len(one) for one in observations):
        return DepthPoints(np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0))
    keypoint = np.concatenate([one.keypoints for one in observations])
    order = np.argsort(keypoint, kind="stable")
    which, merged, free = _merge(
        keypoint[order],
        np.concatenate([one.inverse_depths for one in observations])[order],
        np.concatenate([one.sigmas for one in observations])[order],
        np.concatenate([one.free for one in observations])[order],
        options.tolerance,
        options.sigmas,
    )
    points = DepthPoints(keypoints_px[which], *np.ascontiguousarray(merged.T))
    kept = _supported(points, free, width_px, options, known)
    return DepthPoints(*(getattr(points, name)[kept] for name in points.__slots__))


def _supported(
    points: DepthPoints, free: Mask, width_px: int, options: AgreementOptions, known: DepthPoints | None
) -> Mask:
    agreed = points.confidences == AGREED
    few = agreed.sum() < options.least_agreed or agreed.mean() < options.least_agreed_share
    if few and (known is None or not len(known)):
        return np.ones(len(points), np.bool_)
    mine, all_points = len(points), points if known is None else points.beside(known)
    count = min(2 * options.neighbours + 1, len(all_points))
    distance, index = nearest(all_points.positions_px, points.positions_px, count, options.reach * width_px)
    share = _support(
        distance,
        index,
        all_points.inverse_depths,
        all_points.sigmas,
        np.maximum(all_points.confidences, SINGLE * (np.arange(len(all_points)) >= mine)),
        (options.softening * width_px) ** 2,
        options.apart_px,
        options.neighbours,
        options.support_tolerance,
        options.support_sigmas,
    )
    lenient = free & (points.confidences != CONTRADICTED)
    needed = np.where(lenient, options.support_free, options.support_guided)
    return np.asarray(agreed | (share >= needed), np.bool_)


@compiled
def _merge(
    keypoint: NDArray[np.int64], rho: Floats, sigma: Floats, free: Mask, tolerance: float, sigmas: float
) -> tuple[NDArray[np.int64], Floats, Mask]:
    """The largest agreeing set of each keypoint, input sorted by keypoint: inverse depth, sigma, confidence."""
    total = len(keypoint)
    which = np.empty(total, np.int64)
    merged = np.empty((total, 3))
    any_free = np.zeros(total, np.bool_)
    count = 0
    start = 0
    while start < total:
        end = start
        while end < total and keypoint[end] == keypoint[start]:
            any_free[count] |= free[end]
            end += 1
        which[count] = keypoint[start]
        merged[count] = _largest_set(rho[start:end], sigma[start:end], tolerance, sigmas)
        count += 1
        start = end
    return which[:count], merged[:count], any_free[:count]


@compiled
def _largest_set(rho: Floats, sigma: Floats, tolerance: float, sigmas: float) -> Floats:
    """Inverse depth, sigma and confidence of the largest set that agrees with one of its members."""
    best, most = 0, 0
    for i in range(len(rho)):
        agreeing = 0
        for j in range(len(rho)):
            agreeing += _agrees(rho[i], sigma[i], rho[j], sigma[j], tolerance, sigmas)
        if agreeing > most or (agreeing == most and sigma[i] < sigma[best]):
            best, most = i, agreeing
    weights, weighted = 0.0, 0.0
    for j in range(len(rho)):
        if _agrees(rho[best], sigma[best], rho[j], sigma[j], tolerance, sigmas):
            weights += 1 / sigma[j] ** 2
            weighted += rho[j] / sigma[j] ** 2
    confidence = SINGLE if len(rho) == 1 else CONTRADICTED
    if most >= 2 and 2 * most > len(rho):
        confidence = AGREED
    return np.array([weighted / weights, 1 / np.sqrt(weights), confidence])


@compiled
def _agrees(one: float, one_sigma: float, other: float, other_sigma: float, tolerance: float, sigmas: float) -> bool:
    room = sigmas * np.sqrt(one_sigma**2 + other_sigma**2) + tolerance * max(one, other)
    return bool(abs(one - other) < room)


@compiled
def _support(
    distance: Floats,
    index: NDArray[np.int64],
    rho: Floats,
    sigma: Floats,
    confidence: Floats,
    softening: float,
    apart: float,
    most: int,
    tolerance: float,
    sigmas: float,
) -> Floats:
    """Weighted share (m,) of the first m points' `most` neighbours that agree with them; an index of n is nobody."""
    k, n = index.shape[1], len(rho)
    share = np.zeros(len(index))
    for i in range(len(index)):
        agreeing, weights, met = 0.0, 0.0, 0
        for c in range(k):
            j = index[i, c]
            if j >= n or met == most:
                break
            if distance[i, c] <= apart:
                continue
            met += 1
            weight = confidence[j] / (distance[i, c] ** 2 + softening)
            weights += weight
            if abs(rho[j] - rho[i]) < tolerance * rho[i] + sigmas * np.sqrt(sigma[i] ** 2 + sigma[j] ** 2):
                agreeing += weight
        if weights > 0:
            share[i] = agreeing / weights
    return share
