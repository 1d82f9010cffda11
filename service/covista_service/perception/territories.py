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


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """What an image tells: points (n, 2) on planes, the plane (n,) of each, and nearest first as rows (K, 3)."""

    points_px: Floats
    owners: NDArray[np.intp]
    nearest: Floats


def territories(first: Marks, second: Marks, options: TerritoryOptions) -> tuple[Floats, Floats]:
    """Rows (K, 3) for either image: a pixel v shows the plane k with the largest row . v.

    Nearest first, by inverse depths as functions of the pixel, is right for concave scenes, where endless planes end
    where they meet (the lines l_ij). In front of a box or a globe planes end earlier, and nearest first contradicts
    the points. Then lines between the points of any two planes stand in: a linear discriminant, so that every
    territory stays convex.
    """
    marks = (first, second)
    rivals = [_discriminant(image) for image in marks]
    told = sum(_told(image, image.nearest) for image in marks)
    told_by_rivals = sum(_told(image, rival) for image, rival in zip(marks, rivals, strict=True))
    if told >= options.keep_share * told_by_rivals:
        return first.nearest, second.nearest
    return rivals[0], rivals[1]


def _told(image: Marks, order: Floats) -> int:
    """Number of points that an order puts on their own plane."""
    return int(((homogeneous(image.points_px) @ order.T).argmax(axis=1) == image.owners).sum())


def _discriminant(image: Marks) -> Floats:
    """Fisher's linear discriminant (K, 3): log of each plane's share of a pixel, all planes spread out alike."""
    weights = (image.owners[:, None] == np.arange(len(image.nearest))).astype(np.float64)
    sizes = np.maximum(weights.sum(axis=0), 1)
    centres = (weights.T @ image.points_px) / sizes[:, None]
    gaps = image.points_px - centres[image.owners]
    spread = gaps.T @ gaps / max(len(gaps), 1)
    spread = spread + (_RIDGE * np.trace(spread) + 1e-9) * np.eye(2)
    slopes = np.linalg.solve(spread, centres.T).T
    return np.column_stack((slopes, np.log(sizes) - (slopes * centres).sum(axis=1) / 2))
