"""The planes of a scene: fuzzy clustering from a few starts, judged and pruned by description length."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from covista_service.perception.camera import Floats
from covista_service.perception.description import OUTLIER, Labels, Terms, assign, chosen, pruned, refitted
from covista_service.perception.fuzzy import FuzzyOptions, Points, cluster

# Until the same points lie on the same planes: then rounding leaves no trace.
_MOST_REFITS = 20


@dataclass(frozen=True, slots=True)
class PlaneOptions:
    """`noise_px` of points on planes is one of these, whichever tells a scene in the fewest nats.

    `restarts` of the clustering; a plane needs `min_support` points; a point's `neighbours` are that many.

    `outlier_range_px`: points on no plane are spread evenly over this many pixels. `thinnest`: points whose smaller
    extent in the image is below this share of the larger one lie on a line, which fixes no plane.
    """

    fuzzy: FuzzyOptions = field(default_factory=FuzzyOptions)
    noise_px: tuple[float, ...] = (1.0, 1.4, 2.0, 2.8)
    outlier_range_px: float = 60.0
    restarts: int = 3
    min_support: int = 6
    thinnest: float = 0.03
    refits: int = 2
    neighbours: int = 8


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
    if len(points) < options.min_support:
        return FoundPlanes(np.zeros((0, 3)), np.full(len(points), OUTLIER))
    random = np.random.default_rng(seed)
    cloud = points.cloud
    proposed = [np.zeros((0, 3)) if known is None else known]
    restarts = options.restarts if known is None else min(options.restarts, 1)
    proposed.extend(cluster(cloud, options.fuzzy, random) for _ in range(restarts))
    candidates, beside = np.vstack(proposed), neighbours(points, options.neighbours)
    told = []
    for noise_px in options.noise_px:
        terms = terms_of(noise_px, options)
        picked = chosen(cloud, candidates, terms, options.fuzzy.max_clusters)
        told.append((*pruned(cloud, beside, picked, terms, options.refits), terms))
    planes, _, terms = min(told, key=lambda one: one[1])
    return by_support(cloud, planes, terms)


def neighbours(points: Points, count: int) -> Labels:
    """The points (n, k) next to each in the image."""
    place = points.rays[:, :2]
    count = min(count, len(points) - 1)
    _, found = cKDTree(place).query(place, np.arange(2, count + 2))
    return np.asarray(found, np.int64)


def terms_of(noise_px: float, options: PlaneOptions) -> Terms:
    """Labels tell which points lie on a plane; it costs where any three of them are."""
    outlier = float(np.log(options.outlier_range_px / (noise_px * np.sqrt(2 * np.pi))))
    plane = 3 * outlier
    return Terms(plane, outlier, noise_px, options.min_support, options.thinnest)


def by_support(cloud: Floats, planes: Floats, terms: Terms) -> FoundPlanes:
    """Planes (K, 3), settled, with the points of the cloud (4, n) on each; the one with most points first."""
    planes = refitted(cloud, planes, terms, _MOST_REFITS)
    labels, _ = assign(cloud, planes, terms)
    support = np.bincount(labels[labels != OUTLIER], minlength=len(planes))
    order = np.argsort(-support, kind="stable")
    rank = np.append(np.argsort(order), OUTLIER)
    return FoundPlanes(planes[order], rank[labels])
