"""The planes of a scene: fuzzy clustering from a few starts, judged and pruned by description length."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Floats
from covista_service.perception.fuzzy import FuzzyOptions, Points, cluster, fit

Labels = NDArray[np.intp]
_OUTLIER = -1


@dataclass(frozen=True, slots=True)
class PlaneOptions:
    """`noise_px` of points on a plane; `restarts` of the clustering; a plane needs `min_support` points.

    `outlier_range_px`: points on no plane are spread evenly over this many pixels. `thinnest`: points whose smaller
    extent in the image is below this share of the larger one lie on a line, which fixes no plane.
    """

    fuzzy: FuzzyOptions = field(default_factory=FuzzyOptions)
    noise_px: float = 1.0
    outlier_range_px: float = 60.0
    restarts: int = 2
    min_support: int = 6
    thinnest: float = 0.03
    refits: int = 2


@dataclass(frozen=True, slots=True, eq=False)
class FoundPlanes:
    """`coefficients` c (K, 3): rho = c . (x, y, 1) along a ray; `labels` (n,): the plane of each point, -1 for none."""

    coefficients: Floats
    labels: Labels

    @property
    def normals(self) -> Floats:
        """Planes u . X + 1 = 0 as u (K, 3)."""
        return -self.coefficients


def find_planes(points: Points, options: PlaneOptions, seed: int, known: Floats | None = None) -> FoundPlanes:
    """Planes of n points, strongest first; K may be 0. `known` planes c (K, 3) of an earlier survey save restarts."""
    random = np.random.default_rng(seed)
    if len(points) < options.min_support:
        return FoundPlanes(np.zeros((0, 3)), np.full(len(points), _OUTLIER))
    proposed = [np.zeros((0, 3)) if known is None else known]
    for _ in range(options.restarts if known is None else min(options.restarts, 1)):
        proposed += cluster(points, options.fuzzy, random)
    chosen = _chosen(points, np.vstack(proposed), options)
    return _by_support(points, _pruned(points, chosen, options), options)


def _chosen(points: Points, proposed: Floats, options: PlaneOptions) -> Floats:
    """Planes (K, 3) out of many, each in turn the one that shortens the description most."""
    costs = _costs(points, proposed, options)
    remaining, price = costs[:, 0], _price(points, options)
    picked: list[int] = []
    while len(picked) < options.fuzzy.max_clusters:
        gains = np.maximum(remaining[:, None] - costs[:, 1:], 0.0).sum(axis=0)
        best = int(gains.argmax()) if len(gains) else 0
        if not len(gains) or gains[best] <= price:
            break
        picked.append(best)
        remaining = np.minimum(remaining, costs[:, 1 + best])
    return proposed[picked]


def description_length(points: Points, planes: Floats, options: PlaneOptions) -> float:
    """Nats that it takes to tell the planes, and where all points are.

    Which point lies on which plane comes free: neighbours mostly lie on the same.
    """
    costs = _costs(points, planes, options)
    return float(costs.min(axis=1).sum() + _price(points, options) * len(planes))


def _price(points: Points, options: PlaneOptions) -> float:
    """Nats to tell a plane: which three of the points it goes through, and where each of them is."""
    n = len(points)
    return float(np.log(n * (n - 1) * (n - 2) / 6) + 3 * _outlier_cost(options))


def _outlier_cost(options: PlaneOptions) -> float:
    return float(np.log(options.outlier_range_px / (options.noise_px * np.sqrt(2 * np.pi))))


def assign(points: Points, planes: Floats, options: PlaneOptions) -> Labels:
    """The plane (n,) that tells each point's place in the fewest nats, -1 for none."""
    labels: Labels = _costs(points, planes, options).argmin(axis=1) - 1
    return labels


def _costs(points: Points, planes: Floats, options: PlaneOptions) -> Floats:
    """Nats (n, 1 + K) for each point as an outlier or on a plane."""
    on_plane = points.distances(planes) ** 2 / (2 * options.noise_px**2)
    return np.column_stack((np.full(len(points), _outlier_cost(options)), on_plane))


def _pruned(points: Points, planes: Floats, options: PlaneOptions) -> Floats:
    """Planes refitted to their own points, without those that do not pay for themselves."""
    planes = _refitted(points, planes, options)
    length = description_length(points, planes, options)
    while len(planes):
        fewer = [_refitted(points, np.delete(planes, k, axis=0), options) for k in range(len(planes))]
        lengths = [description_length(points, rest, options) for rest in fewer]
        shortest = int(np.argmin(lengths))
        if lengths[shortest] > length:
            break
        planes, length = fewer[shortest], lengths[shortest]
    return planes


def _refitted(points: Points, planes: Floats, options: PlaneOptions) -> Floats:
    """Planes fitted to the points assigned to them; those with too few points, or with points on a line, are gone."""
    moments = points.moments
    for _ in range(options.refits):
        weights = (assign(points, planes, options)[:, None] == np.arange(len(planes))).astype(np.float64)
        planes = fit(moments, weights)[_is_plane(points, weights, options)]
    return planes


def _is_plane(points: Points, weights: Floats, options: PlaneOptions) -> NDArray[np.bool_]:
    """Which clusters (K,) with hard `weights` (n, K) have enough points, spread over an area?"""
    support = weights.sum(axis=0)
    shares = weights / np.maximum(support, 1)
    x, y = points.rays[:, 0], points.rays[:, 1]
    centre_x, centre_y = x @ shares, y @ shares
    xx, yy = (x * x) @ shares - centre_x**2, (y * y) @ shares - centre_y**2
    xy = (x * y) @ shares - centre_x * centre_y
    half, gap = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    wide: NDArray[np.bool_] = half - gap > options.thinnest**2 * (half + gap)
    enough: NDArray[np.bool_] = support >= options.min_support
    return wide & enough


def _by_support(points: Points, planes: Floats, options: PlaneOptions) -> FoundPlanes:
    labels = assign(points, planes, options)
    support = np.bincount(labels[labels != _OUTLIER], minlength=len(planes))
    order = np.argsort(-support, kind="stable")
    rank = np.append(np.argsort(order), _OUTLIER)
    return FoundPlanes(planes[order], rank[labels])
