"""Adaptive fuzzy clustering of points into planes, with an outlier cluster (Eqs. 1 to 6).

Where the paper clusters points in space, these functions work where noise is uniform: a point is its ray (x, y, 1) in
the first camera and its inverse depth rho, a plane is rho = c . (x, y, 1), and the distance (4) of a point from a plane
is how far, in pixels, the plane would put it from where the second image shows it.

Clouds are arrays (4, n) of x, y, rho and px per unit of inverse depth; weights and memberships are (K, n).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats
from covista_service.perception.seeding import initial_cells, robust_planes

_TINY = 1e-12
_RIDGE = 1e-9


@dataclass(frozen=True, slots=True)
class FuzzyOptions:
    """Options of the clustering.

    `delta_px` is the distance at which a point belongs to the outliers as much as to a plane (delta of Eq. 5);
    `floor` is the share of it below which distances count no further, the volume of Kaymak and Setnes' prototypes.
    """

    max_clusters: int = 10
    points_per_cluster: int = 6
    delta_px: float = 2.0
    floor: float = 0.5
    initial_iterations: int = 8
    triples: int = 30
    iterations: int = 4
    settled: float = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """`rays` (n, 3) with third coordinate 1, `inverse_depths` (n,), `shifts_px` (n,): px per unit of inverse depth."""

    rays: Floats
    inverse_depths: Floats
    shifts_px: Floats

    def __len__(self) -> int:
        return len(self.rays)

    @property
    def cloud(self) -> Floats:
        """Points (4, n) as x, y, rho and px per unit of inverse depth."""
        return np.stack((self.rays[:, 0], self.rays[:, 1], self.inverse_depths, self.shifts_px))

    def distances(self, planes: Floats) -> Floats:
        """Distances (n, K) in px from planes c (K, 3): Eq. 4 as transfer error in the second image."""
        away: Floats = np.abs(self.rays @ planes.T - self.inverse_depths[:, None]) * self.shifts_px[:, None]
        return away


def cluster(cloud: Floats, options: FuzzyOptions, random: np.random.Generator) -> Floats:
    """Planes c (K, 3) that the points of a cloud lie on, one after the other those after each merging."""
    n = cloud.shape[1]
    count = min(options.max_clusters, n // options.points_per_cluster)
    cells = initial_cells(cloud, random.choice(n, count, replace=False), options.initial_iterations)
    draws = random.random((count, options.triples, 3))
    planes = robust_planes(cloud, cells, draws, options.delta_px)
    return _stages(cloud, planes, options.floor, options.delta_px, options.iterations, options.settled)


@compiled
def noise_memberships(cloud: Floats, planes: Floats, floor: float, delta_px: float) -> Floats:
    """Memberships (K, n) that minimise (5) with m = 2; what is missing to 1 belongs to the outlier cluster."""
    least = floor * delta_px
    memberships = np.empty((len(planes), cloud.shape[1]))
    total = np.full(cloud.shape[1], delta_px**-2.0)
    for k in range(len(planes)):
        a, b, c = planes[k]
        for i in range(cloud.shape[1]):
            away = max(abs(a * cloud[0, i] + b * cloud[1, i] + c - cloud[2, i]) * cloud[3, i], least)  # (4)
            memberships[k, i] = 1.0 / (away * away)
            total[i] += memberships[k, i]
    for k in range(len(planes)):
        for i in range(cloud.shape[1]):
            memberships[k, i] /= total[i]
    return memberships


@compiled
def fit(cloud: Floats, weights: Floats) -> Floats:
    """Planes c (K, 3) through a cloud with `weights` (K, n), least squares in px.

    The centre (1) and the covariance (3) of (x, y, rho) give it: noise lies along rho alone, so the plane holds the
    centre and has the slope that the covariance tells.
    """
    planes = np.empty((len(weights), 3))
    for k in range(len(weights)):
        total = x = y = rho = xx = xy = yy = xr = yr = 0.0
        for i in range(cloud.shape[1]):
            px, py, pr = cloud[0, i], cloud[1, i], cloud[2, i]
            w = weights[k, i] * cloud[3, i] * cloud[3, i]
            total += w
            x, y, rho = x + w * px, y + w * py, rho + w * pr
            xx, xy, yy = xx + w * px * px, xy + w * px * py, yy + w * py * py
            xr, yr = xr + w * px * pr, yr + w * py * pr
        share = 1.0 / (total + _TINY)
        x, y, rho = x * share, y * share, rho * share  # (1)
        xx, xy, yy = xx * share - x * x, xy * share - x * y, yy * share - y * y  # (3)
        xr, yr = xr * share - x * rho, yr * share - y * rho
        ridge = _RIDGE * (xx + yy) + _TINY
        xx, yy = xx + ridge, yy + ridge
        area = xx * yy - xy * xy
        slope_x, slope_y = (xr * yy - yr * xy) / area, (yr * xx - xr * xy) / area
        planes[k] = slope_x, slope_y, total * share * (rho - slope_x * x - slope_y * y)
    return planes


@compiled
def most_similar(memberships: Floats) -> tuple[int, int]:
    """The two clusters with the largest inclusion (6), or (-1, -1) if none are similar enough.

    The threshold counts the outlier cluster, 1 / K for K planes: with 1 / (K - 1) two could never become one.
    """
    count = len(memberships)
    pair, largest = (-1, -1), 1.0 / max(count, 1)
    sizes = memberships.sum(axis=1)
    for one in range(count):
        for other in range(one):
            shared = 0.0
            for i in range(memberships.shape[1]):
                shared += min(memberships[one, i], memberships[other, i])
            inclusion = shared / (min(sizes[one], sizes[other]) + _TINY)
            if inclusion > largest:
                pair, largest = (other, one), inclusion
    return pair


@compiled
def merged(memberships: Floats, one: int, other: int) -> Floats:
    """Memberships (K - 1, n) with clusters one < other made one."""
    rest = np.empty((len(memberships) - 1, memberships.shape[1]))
    rest[:other] = memberships[:other]
    rest[other:] = memberships[other + 1 :]
    rest[one] += memberships[other]
    return rest


@compiled
def _stages(
    cloud: Floats, planes: Floats, floor: float, delta_px: float, iterations: int, settled: float
) -> NDArray[np.float64]:
    """Planes at first and after each merging, of the two most similar at a time, until none are similar enough."""
    count = len(planes)
    stages = np.empty((count + count * (count + 1) // 2, 3))
    stages[:count] = planes
    filled = count
    memberships = noise_memberships(cloud, planes, floor, delta_px)
    one = 0
    while one >= 0 and len(memberships):
        # Turn by turn planes from memberships and memberships from planes, until little changes.
        for _ in range(iterations):
            planes = fit(cloud, memberships * memberships)
            updated = noise_memberships(cloud, planes, floor, delta_px)
            change = np.abs(updated - memberships).max()
            memberships = updated
            if change < settled:
                break
        stages[filled : filled + len(planes)] = planes
        filled += len(planes)
        one, other = most_similar(memberships)
        if one >= 0:
            memberships = merged(memberships, one, other)
    return stages[:filled]
