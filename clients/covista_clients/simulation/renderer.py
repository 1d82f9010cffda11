"""Pictures and exact depth of a world, by casting a ray through every pixel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from covista_schemas.messages import Camera, Pose
from numpy.typing import NDArray

from covista_clients.simulation.shading import shade
from covista_clients.simulation.sight import NOTHING, Sight, sight
from covista_clients.simulation.world import World

Singles = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Rendering:
    """`image` (H, W, 3) BGR uint8 and `depth_m` (H, W) float32 along the optical axis, 0 where there is nothing."""

    image: NDArray[np.uint8]
    depth_m: Singles


def render(world: World, camera: Camera, pose: Pose) -> Rendering:
    """What `camera` sees from `pose`; the same arguments give the same bytes. Raises ValueError for a lens."""
    seen = sight(world.facets, camera, pose)
    inverse_depth, index = _nearest(seen, camera)
    image = shade(world, camera, pose, seen, inverse_depth, index)
    met = index != NOTHING
    depth = np.zeros_like(inverse_depth)
    np.divide(1, inverse_depth, out=depth, where=met)
    return Rendering(_soft_edges(image, index), depth)


def _nearest(seen: Sight, camera: Camera) -> tuple[Singles, NDArray[np.int64]]:
    """Inverse depth (H, W) of the first hit and its index in `seen`, or NOTHING."""
    best = np.zeros((camera.height, camera.width), np.float32)
    index = np.full((camera.height, camera.width), NOTHING, np.int64)
    windows = _windows(seen, camera)
    lines = np.concatenate([seen.inside, -seen.inverse_depth[:, None]], axis=1)
    least = _least(lines, windows)
    for k, (x0, y0, x1, y1) in enumerate(windows.tolist()):
        here = best[y0:y1, x0:x1]
        # Nearest facets come first, so much of what follows is hidden altogether.
        if not here.size or -least[k, 4] <= here.min():
            continue
        columns, rows = np.arange(x0, x1), np.arange(y0, y1)
        rho = _affine(seen.inverse_depth[k], columns, rows)
        nearer = rho > here
        for edge in np.flatnonzero(least[k, :4] < 0):
            nearer &= _affine(seen.inside[k, edge], columns, rows) >= 0
        np.copyto(here, rho, where=nearer)
        np.copyto(index[y0:y1, x0:x1], k, where=nearer)
    return best, index


def _windows(seen: Sight, camera: Camera) -> NDArray[np.int64]:
    """Columns and rows x0, y0, x1, y1 (exclusive) that hold each facet's picture, (K, 4)."""
    limit = (camera.width, camera.height)
    first = np.clip(np.ceil(seen.bounds_px[:, :2]), 0, limit)
    end = np.clip(np.floor(seen.bounds_px[:, 2:]) + 1, first, limit)
    return np.concatenate([first, end], axis=1).astype(np.int64)


def _least(lines: NDArray[np.float64], windows: NDArray[np.int64]) -> NDArray[np.float64]:
    """Least values (K, L) of lines (K, L, 3) . (x, y, 1) in windows (K, 4): they lie in corners."""
    x0, y0, x1, y1 = windows.T[:, :, None]
    across = np.minimum(lines[..., 0] * x0, lines[..., 0] * (x1 - 1))
    down = np.minimum(lines[..., 1] * y0, lines[..., 1] * (y1 - 1))
    return np.asarray(across + down + lines[..., 2], np.float64)


def _affine(line: NDArray[np.float64], columns: NDArray[np.int64], rows: NDArray[np.int64]) -> Singles:
    """The value of `line` . (x, y, 1) at every pixel of a window."""
    across = (line[0] * columns).astype(np.float32)
    down = (line[1] * rows + line[2]).astype(np.float32)
    return np.asarray(np.add.outer(down, across), np.float32)


def _soft_edges(image: NDArray[np.uint8], index: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Silhouettes without stairs: pixels on either side of one are mixed with their neighbours."""
    edge = np.zeros(index.shape, np.uint8)
    beside = index[:, 1:] != index[:, :-1]
    below = index[1:] != index[:-1]
    edge[:, 1:][beside] = edge[:, :-1][beside] = 1
    edge[1:][below] = edge[:-1][below] = 1
    return np.asarray(cv2.copyTo(cv2.GaussianBlur(image, (3, 3), 0), edge, image), np.uint8)
