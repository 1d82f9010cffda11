"""Which part of an image shows which plane, where planes end before they meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Floats
from covista_service.perception.epipolar import homogeneous

# Share of the mean variance added to either axis: points of all planes may lie in line.
_RIDGE = 1e-3


@dataclass(frozen=True, slots=True)
class TerritoryOptions:
    """The nearest plane is what is seen unless that tells less than `keep_share` of the points that the rival tells."""

    keep_share: float = 0.9


def territories(points_px: Floats, labels: NDArray[np.intp], nearest: Floats, options: TerritoryOptions) -> Floats:
    """Rows (K, 3): a pixel v shows the plane k with the largest row . v.

    `nearest` (K, 3) are the planes' inverse depths as functions of the pixel: nearest first, right for concave scenes,
    where endless planes end where they meet (the lines l_ij). In front of a box or a globe planes end earlier, and
    nearest first contradicts the points (n, 2) that lie on the planes, with `labels` (n,), -1 for none. Then lines
    between the points of any two planes stand in: a linear discriminant, so that every territory stays convex.
    """
    on_plane = labels >= 0
    pixels, owners = homogeneous(points_px[on_plane]), labels[on_plane]
    between = _discriminant(pixels[:, :2], owners, len(nearest))
    told = ((pixels @ nearest.T).argmax(axis=1) == owners).sum()
    rivals = ((pixels @ between.T).argmax(axis=1) == owners).sum()
    return nearest if told >= options.keep_share * rivals else between


def _discriminant(points_px: Floats, owners: NDArray[np.intp], count: int) -> Floats:
    """Fisher's linear discriminant (K, 3): log of each plane's share of a pixel, all planes spread out alike."""
    weights = (owners[:, None] == np.arange(count)).astype(np.float64)
    sizes = np.maximum(weights.sum(axis=0), 1)
    centres = (weights.T @ points_px) / sizes[:, None]
    gaps = points_px - centres[owners]
    spread = gaps.T @ gaps / max(len(points_px), 1)
    spread = spread + (_RIDGE * np.trace(spread) + 1e-9) * np.eye(2)
    slopes = np.linalg.solve(spread, centres.T).T
    return np.column_stack((slopes, np.log(sizes) - (slopes * centres).sum(axis=1) / 2))
