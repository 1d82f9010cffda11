"""A keyframe's surface: inverse depth on a coarse grid, robust and affine in each cell, so exact on planes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.agreement import DepthPoints
from covista_service.perception.camera import Camera, Floats
from covista_service.perception.nearest import nearest

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
    clip: float = 0.30
    grey_sigma: float = 20.0
    grey_floor: float = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """`inverse_depth` (ROWS, COLUMNS) 1/m along the optical axis at the cells' centres; `sigma`, its share of it."""

    inverse_depth: Floats
    sigma: Floats


def stacked(surfaces: Sequence[Surface]) -> tuple[Floats, Floats]:
    """Inverse depths and sigmas (n, ROWS, COLUMNS) of surfaces."""
    if not surfaces:
        return np.empty((0, ROWS, COLUMNS)), np.empty((0, ROWS, COLUMNS))
    # Rows upon rows: much faster than an array of arrays.
    depths = np.concatenate([surface.inverse_depth for surface in surfaces], dtype=np.float64)
    sigmas = np.concatenate([surface.sigma for surface in surfaces], dtype=np.float64)
    return depths.reshape(-1, ROWS, COLUMNS), sigmas.reshape(-1, ROWS, COLUMNS)


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
    distance, index = nearest(points.positions_px, cells, count)
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
    # Of a cell's neighbours: weight, offset (x, y) from the cell, inverse depth, scale of the loss, current weight.
    near = np.empty((6, k))
    for i in range(n):
        total, mean, error = 0.0, 0.0, 0.0
        low, high = np.inf, -np.inf
        for c in range(k):
            j = index[i, c]
            relative = sigma[j] / rho[j]
            spread = (relative**2 + floor**2) * (distance[i, c] ** 2 + _CELL**2) ** 2
            weight = confidence[j] * likeness[i, c] / spread
            total += weight
            mean += weight * rho[j]
            error += weight * relative
            low, high = min(low, rho[j]), max(high, rho[j])
            near[0, c] = weight
            near[1, c], near[2, c] = positions[j, 0] - cells[i, 0], positions[j, 1] - cells[i, 1]
            near[3, c], near[4, c] = rho[j], loss + 2 * relative
        mean /= total
        error /= total
        near[0] /= total
        near[3] /= mean
        here = _affine(near, ridge**2 + error**2, passes)
        fitted[0, i] = min(max(here * mean, low * (1 - clip)), high * (1 + clip))
        fitted[1, i] = error
    return fitted


@compiled
def _affine(near: Floats, damping: float, passes: int) -> float:
    """Value at offset 0 of an affine fit to the ratios near[3], its gradient damped, its residuals under Cauchy's loss.

    `near` (6, k): weight, offset x and y, ratio, scale of the loss, and room for the weight under the loss.
    """
    value, along, down = 1.0, 0.0, 0.0
    weight, x, y, ratio, scale, w = near
    for step in range(passes + 1):
        total, mx, my, mr = 0.0, 0.0, 0.0, 0.0
        for c in range(len(w)):
            w[c] = weight[c]
            if step:
                w[c] /= 1 + ((ratio[c] - value - along * x[c] - down * y[c]) / scale[c]) ** 2
            total += w[c]
            mx, my, mr = mx + w[c] * x[c], my + w[c] * y[c], mr + w[c] * ratio[c]
        mx, my, mr = mx / total, my / total, mr / total
        # About the mean, where nothing cancels.
        xx, xy, yy, xr, yr = damping, 0.0, damping, 0.0, 0.0
        for c in range(len(w)):
            share, dx, dy = w[c] / total, x[c] - mx, y[c] - my
            xx, xy, yy = xx + share * dx * dx, xy + share * dx * dy, yy + share * dy * dy
            xr, yr = xr + share * dx * (ratio[c] - mr), yr + share * dy * (ratio[c] - mr)
        determinant = xx * yy - xy * xy
        along = (yy * xr - xy * yr) / determinant
        down = (xx * yr - xy * xr) / determinant
        value = mr - along * mx - down * my
    return value
