"""First planes to cluster points from: fuzzy c-means puts each point in a cell, each cell proposes a plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats

_TINY = 1e-12
Cells = NDArray[np.int64]


@compiled
def initial_cells(cloud: Floats, seeds: Cells, iterations: int) -> Cells:
    """The cell (n,) that fuzzy c-means (1), (2) with m = 2 puts each point of a cloud (4, n) in, by x, y and rho.

    `seeds` (K,) are the points that the centres start from.
    """
    n, count = cloud.shape[1], len(seeds)
    place = np.empty((3, n))
    for axis in range(3):
        place[axis] = (cloud[axis] - cloud[axis].mean()) / (cloud[axis].std() + _TINY)
    centres = np.empty((count, 3))
    for k in range(count):
        centres[k] = place[:, seeds[k]]
    closeness = np.empty((count, n))
    total = np.empty(n)
    for _ in range(iterations):
        total[:] = 0.0
        for k in range(count):
            x, y, z = centres[k]
            for i in range(n):
                gap = (place[0, i] - x) ** 2 + (place[1, i] - y) ** 2 + (place[2, i] - z) ** 2
                closeness[k, i] = 1.0 / (gap + _TINY)
                total[i] += closeness[k, i]
        for k in range(count):
            size = x = y = z = 0.0
            for i in range(n):
                weight = (closeness[k, i] / total[i]) ** 2  # (2)
                size += weight
                x, y, z = x + weight * place[0, i], y + weight * place[1, i], z + weight * place[2, i]
            size += _TINY
            centres[k] = x / size, y / size, z / size  # (1)
    return _nearest(place, centres)


@compiled
def _nearest(place: Floats, centres: Floats) -> Cells:
    cells = np.zeros(place.shape[1], np.int64)
    for i in range(place.shape[1]):
        nearest = np.inf
        for k in range(len(centres)):
            gap = (place[0, i] - centres[k, 0]) ** 2 + (place[1, i] - centres[k, 1]) ** 2
            gap += (place[2, i] - centres[k, 2]) ** 2
            if gap < nearest:
                nearest, cells[i] = gap, k
    return cells


@compiled
def robust_planes(cloud: Floats, cells: Cells, draws: Floats, delta_px: float) -> Floats:
    """For each cell with enough points the plane c (K, 3) through three of them that most others of the cell lie near.

    `draws` (cells, triples, 3) in [0, 1) choose the points. Least squares would let one outlier among a cell's few
    points spoil its first plane for good.
    """
    planes = np.empty((len(draws), 3))
    found = 0
    for k in range(len(draws)):
        own = cloud[:, cells == k]
        least = np.inf
        for draw in draws[k]:
            fixed, a, b, c = through(own, draw)
            if not fixed:
                continue
            away = 0.0
            for i in range(own.shape[1]):
                away += min(abs(a * own[0, i] + b * own[1, i] + c - own[2, i]) * own[3, i], delta_px)
            if away < least:
                least = away
                planes[found] = a, b, c
        found += least < np.inf
    return planes[:found]


@compiled
def through(own: Floats, draw: Floats) -> tuple[bool, float, float, float]:
    """The plane c through the three points of a cloud that a draw chooses, and whether they fix one."""
    size = own.shape[1]
    p, q, r = int(draw[0] * size), int(draw[1] * size), int(draw[2] * size)
    if p in (q, r) or q == r:
        return False, 0.0, 0.0, 0.0
    dx, dy, dr = own[0, q] - own[0, p], own[1, q] - own[1, p], own[2, q] - own[2, p]
    ex, ey, er = own[0, r] - own[0, p], own[1, r] - own[1, p], own[2, r] - own[2, p]
    area = dx * ey - dy * ex
    if abs(area) <= _TINY:
        return False, 0.0, 0.0, 0.0
    slope_x, slope_y = (dr * ey - er * dy) / area, (dx * er - ex * dr) / area
    return True, slope_x, slope_y, own[2, p] - slope_x * own[0, p] - slope_y * own[1, p]
