"""Adaptive fuzzy clustering of points into planes, with an outlier cluster (Eqs. 1 to 6).

Where the paper clusters points in space, these functions work where noise is uniform: a point is its ray (x, y, 1) in
the first camera and its inverse depth rho, a plane is rho = c . (x, y, 1), and the distance (4) of a point from a plane
is how far, in pixels, the plane would put it from where the second image shows it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Floats

_TINY = 1e-12
_RIDGE = 1e-9
Cells = NDArray[np.intp]


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
    def place(self) -> Floats:
        """Points (n, 3) as (x, y, rho)."""
        return np.column_stack((self.rays[:, :2], self.inverse_depths))

    @property
    def moments(self) -> Floats:
        """Products (n, 9): 1, x, y, rho, xx, xy, yy, x rho, y rho, each times the squared px per inverse depth."""
        x, y, rho = self.place.T
        products: Floats = np.column_stack((np.ones(len(self)), x, y, rho, x * x, x * y, y * y, x * rho, y * rho))
        return products * (self.shifts_px**2)[:, None]

    def distances(self, planes: Floats) -> Floats:
        """Distances (n, K) in px from planes c (K, 3): Eq. 4 as transfer error in the second image."""
        away: Floats = np.abs(self.rays @ planes.T - self.inverse_depths[:, None]) * self.shifts_px[:, None]
        return away


def cluster(points: Points, options: FuzzyOptions, random: np.random.Generator) -> list[Floats]:
    """Planes c (K, 3) that the points lie on, after each merging: from many down to those that are left at the end."""
    planes = _robust_planes(points, initial_cells(points, options, random), options, random)
    stages, moments = [planes], points.moments
    memberships: Floats | None = noise_memberships(points.distances(planes), options)
    while memberships is not None and memberships.shape[1]:
        memberships, planes = _settle(points, moments, memberships, options)
        stages.append(planes)
        memberships = merge_most_similar(memberships)
    return stages


def initial_cells(points: Points, options: FuzzyOptions, random: np.random.Generator) -> Cells:
    """The cell (n,) that fuzzy c-means (1), (2) with m = 2 puts each point in, by pixel and inverse depth."""
    count = min(options.max_clusters, len(points) // options.points_per_cluster)
    place = points.place
    place = (place - place.mean(axis=0)) / (place.std(axis=0) + _TINY)
    centres = place[random.choice(len(place), count, replace=False)]
    for _ in range(options.initial_iterations):
        weights = _fuzzy_memberships(_squared_gaps(place, centres)) ** 2
        centres = (weights.T @ place) / (weights.sum(axis=0)[:, None] + _TINY)  # (1)
    cells: Cells = _squared_gaps(place, centres).argmin(axis=1)
    return cells


def _robust_planes(points: Points, cells: Cells, options: FuzzyOptions, random: np.random.Generator) -> Floats:
    """For each cell with enough points the plane c (K, 3) through three of them that most others of the cell lie near.

    Least squares would let one outlier among a cell's few points spoil its first plane for good.
    """
    planes = []
    for cell in np.unique(cells):
        own = np.flatnonzero(cells == cell)
        members = Points(points.rays[own], points.inverse_depths[own], points.shifts_px[own])
        proposed = _through(members.place[random.integers(len(own), size=(options.triples, 3))])
        if len(proposed):
            away = members.distances(proposed)
            planes.append(proposed[np.minimum(away, options.delta_px).sum(axis=0).argmin()])
    return np.array(planes).reshape(-1, 3)


def _through(triples: Floats) -> Floats:
    """Planes c (k, 3) through triples (m, 3, 3) of points (x, y, rho), k <= m of which are not in line."""
    (dx, dy, dr), (ex, ey, er) = (triples[:, 1] - triples[:, 0]).T, (triples[:, 2] - triples[:, 0]).T
    area = dx * ey - dy * ex
    fixed = np.abs(area) > _TINY
    area = np.where(fixed, area, 1.0)
    slope_x, slope_y = (dr * ey - er * dy) / area, (dx * er - ex * dr) / area
    x, y, rho = triples[:, 0].T
    planes: Floats = np.column_stack((slope_x, slope_y, rho - slope_x * x - slope_y * y))
    kept: Floats = planes[fixed]
    return kept


def noise_memberships(distances: Floats, options: FuzzyOptions) -> Floats:
    """Memberships (n, K) that minimise (5) with m = 2; what is missing to 1 belongs to the outlier cluster."""
    closeness = np.maximum(distances, options.floor * options.delta_px) ** -2.0
    memberships: Floats = closeness / (closeness.sum(axis=1) + options.delta_px**-2)[:, None]
    return memberships


def fit(moments: Floats, weights: Floats) -> Floats:
    """Planes c (K, 3) through points with `moments` (n, 9) and `weights` (n, K), least squares in px.

    The centre (1) and the covariance (3) of (x, y, rho) give it: noise lies along rho alone, so the plane holds the
    centre and has the slope that the covariance tells.
    """
    sums = (weights.T @ moments).T
    total, x, y, rho, xx, xy, yy, xr, yr = sums / (sums[0] + _TINY)  # (1): x, y, rho
    xx, xy, yy, xr, yr = xx - x * x, xy - x * y, yy - y * y, xr - x * rho, yr - y * rho  # (3)
    xx, yy = xx + _RIDGE * (xx + yy) + _TINY, yy + _RIDGE * (xx + yy) + _TINY
    area = xx * yy - xy * xy
    slope_x, slope_y = (xr * yy - yr * xy) / area, (yr * xx - xr * xy) / area
    return np.column_stack((slope_x, slope_y, total * (rho - slope_x * x - slope_y * y)))


def merge_most_similar(memberships: Floats) -> Floats | None:
    """Memberships (n, K - 1) with the two most similar clusters made one, or None if none are similar enough (6).

    The threshold counts the outlier cluster, 1 / K for K planes: with 1 / (K - 1) two could never become one.
    """
    count = memberships.shape[1]
    if count < 2:
        return None
    sizes = memberships.sum(axis=0)
    rows = np.ascontiguousarray(memberships.T)
    shared = np.minimum(rows[:, None, :], rows[None, :, :]).sum(axis=2)
    inclusion = shared / (np.minimum(sizes[:, None], sizes) + _TINY)
    np.fill_diagonal(inclusion, -1.0)
    one, other = np.unravel_index(int(inclusion.argmax()), inclusion.shape)
    if inclusion[one, other] <= 1.0 / count:
        return None
    merged = np.delete(memberships, other, axis=1)
    merged[:, one - (other < one)] = memberships[:, one] + memberships[:, other]
    return merged


def _settle(points: Points, moments: Floats, memberships: Floats, options: FuzzyOptions) -> tuple[Floats, Floats]:
    """Turn by turn planes from memberships and memberships from planes, until little changes."""
    for _ in range(options.iterations):
        planes = fit(moments, memberships**2)
        updated = noise_memberships(points.distances(planes), options)
        change = np.abs(updated - memberships).max()
        memberships = updated
        if change < options.settled:
            break
    return memberships, planes


def _squared_gaps(place: Floats, centres: Floats) -> Floats:
    gaps: Floats = ((place[:, None, :] - centres) ** 2).sum(axis=2)
    return gaps


def _fuzzy_memberships(squared: Floats) -> Floats:
    closeness = 1.0 / (squared + _TINY)
    memberships: Floats = closeness / closeness.sum(axis=1)[:, None]
    return memberships
