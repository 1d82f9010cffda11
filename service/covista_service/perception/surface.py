"""A keyframe's surface: inverse depth on a coarse grid, robust and affine in each cell, so exact on planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from covista_service.perception.agreement import DepthPoints
from covista_service.perception.camera import Camera, Floats
from covista_service.perception.compiled import compiled

COLUMNS, ROWS = 48, 36
_CELL = 1.0 / COLUMNS


@dataclass(frozen=True, slots=True)
class SurfaceOptions:
    """A cell's inverse depth is fitted to its nearest `neighbours`.

    `floor` is what even the best point may be off by, `loss` (beside 2 sigma) the scale of Cauchy's loss in `passes`
    passes, `ridge` damps the gradient; all as shares of the inverse depth, the gradient per image width. The value
    stays within the neighbours' range, widened by `clip`. With a thumbnail, neighbours of another grey weigh less:
    by a normal curve of `grey_sigma` levels above `grey_floor`.
    """

    neighbours: int = 12
    floor: float = 0.01
    loss: float = 0.03
    passes: int = 2
    ridge: float = 0.005
    clip: float = 0.10
    grey_sigma: float = 20.0
    grey_floor: float = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """`inverse_depth` (ROWS, COLUMNS) 1/m along the optical axis at the cells' centres; `sigma`, its share of it."""

    inverse_depth: Floats
    sigma: Floats


def flat(inverse_depth: float, sigma: float = 0.3) -> Surface:
    """A plane parallel to the image, for a keyframe of which no more than its median depth is known."""
    return Surface(np.full((ROWS, COLUMNS), inverse_depth), np.full((ROWS, COLUMNS), sigma))


def cell_centres(camera: Camera) -> Floats:
    """Pixel coordinates (ROWS * COLUMNS, 2) of the cells' centres, row by row."""
    x = (np.arange(COLUMNS) + 0.5) * camera.width / COLUMNS - 0.5
    y = (np.arange(ROWS) + 0.5) * camera.height / ROWS - 0.5
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def interpolate(
    points: DepthPoints, camera: Camera, options: SurfaceOptions, thumbnail: NDArray[np.uint8] | None = None
) -> Surface:
    """The surface through one point or more; `thumbnail` (h, w) is the same image, small and grey, if there is one."""
    cells = cell_centres(camera)
    count = min(options.neighbours, len(points))
    distance, index = KDTree(points.positions_px).query(cells, count)
    distance = np.asarray(distance, np.float64).reshape(-1, count)
    index = np.asarray(index, np.int64).reshape(-1, count)
    likeness = np.ones((len(cells), count))
    if thumbnail is not None:
        likeness = _likeness(thumbnail, camera, cells, points.positions_px, index, options)
    # Lengths in image widths, so that nothing depends on the resolution.
    fitted = _fit(
        cells / camera.width,
        points.positions_px / camera.width,
        points.inverse_depths,
        points.sigmas,
        points.confidences * 1.0,
        distance / camera.width,
        index,
        likeness,
        np.array([options.floor, options.loss, options.ridge, options.clip]),
        options.passes,
    )
    return Surface(fitted[0].reshape(ROWS, COLUMNS), fitted[1].reshape(ROWS, COLUMNS))


def _likeness(
    thumbnail: NDArray[np.uint8],
    camera: Camera,
    cells: Floats,
    positions: Floats,
    index: NDArray[np.int64],
    options: SurfaceOptions,
) -> Floats:
    height, width = thumbnail.shape

    def grey(points: Floats) -> Floats:
        column = np.clip((points[:, 0] + 0.5) * width / camera.width, 0, width - 1).astype(np.intp)
        row = np.clip((points[:, 1] + 0.5) * height / camera.height, 0, height - 1).astype(np.intp)
        return np.asarray(thumbnail[row, column], np.float64)

    difference = grey(cells)[:, None] - grey(positions)[index]
    return np.asarray(options.grey_floor + np.exp(-(difference**2) / (2 * options.grey_sigma**2)), np.float64)


@compiled
def _fit(
    cells: Floats,
    positions: Floats,
    rho: Floats,
    sigma: Floats,
    confidence: Floats,
    distance: Floats,
    index: NDArray[np.int64],
    likeness: Floats,
    scales: Floats,
    passes: int,
) -> Floats:
    """Inverse depth and relative sigma (2, n) at each of n cells; `scales` are floor, loss, ridge and clip."""
    n, k = index.shape
    floor, loss, ridge, clip = scales
    fitted = np.empty((2, n))
    weight, ratio, relative = np.empty(k), np.empty(k), np.empty(k)
    offset = np.empty((k, 2))
    for i in range(n):
        for c in range(k):
            j = index[i, c]
            relative[c] = sigma[j] / rho[j]
            spread = (relative[c] ** 2 + floor**2) * (distance[i, c] ** 2 + _CELL**2) ** 2
            weight[c] = confidence[j] * likeness[i, c] / spread
            ratio[c] = rho[j]
            offset[c] = positions[j] - cells[i]
        weight /= weight.sum()
        mean = (weight * ratio).sum()
        error = (weight * relative).sum()
        low, high = ratio.min() * (1 - clip), ratio.max() * (1 + clip)
        ratio /= mean
        here = _affine(offset, ratio, loss + 2 * relative, weight, ridge**2 + error**2, passes)
        fitted[0, i] = min(max(here * mean, low), high)
        fitted[1, i] = error
    return fitted


@compiled
def _affine(offset: Floats, ratio: Floats, scale: Floats, weight: Floats, damping: float, passes: int) -> float:
    """Value at offset 0 of an affine fit to `ratio` (k,), its gradient damped, its residuals under Cauchy's loss."""
    value, along, down = 1.0, 0.0, 0.0
    w = weight.copy()
    x, y = offset[:, 0], offset[:, 1]
    for step in range(passes + 1):
        if step:
            w = weight / (1 + ((ratio - value - along * x - down * y) / scale) ** 2)
        w = w / w.sum()
        mx, my, mr = (w * x).sum(), (w * y).sum(), (w * ratio).sum()
        xx = (w * x * x).sum() - mx * mx + damping
        xy = (w * x * y).sum() - mx * my
        yy = (w * y * y).sum() - my * my + damping
        xr = (w * x * ratio).sum() - mx * mr
        yr = (w * y * ratio).sum() - my * mr
        determinant = xx * yy - xy * xy
        along = (yy * xr - xy * yr) / determinant
        down = (xx * yr - xy * xr) / determinant
        value = mr - along * mx - down * my
    return value
