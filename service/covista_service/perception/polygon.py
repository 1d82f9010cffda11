"""Convex polygons in an image, cut exactly by lines.

Polygons have a handful of corners, for which plain Python is several times quicker than arrays.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from covista_service.perception.camera import Floats

Polygon = list[tuple[float, float]]


def rectangle(width_px: int, height_px: int) -> Polygon:
    """The image itself: pixel centres at integers, so its border runs half a pixel outside of them."""
    right, bottom = width_px - 0.5, height_px - 0.5
    return [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom)]


def cut(polygon: Polygon, conditions: Iterable[Sequence[float]]) -> Polygon:
    """The part of a convex polygon where a x + b y + c >= 0 for every condition (a, b, c); empty where none is left."""
    for a, b, c in conditions:
        if len(polygon) < 3:
            return []
        polygon = _cut_once(polygon, a, b, c)
    return polygon if len(polygon) >= 3 else []


def area(polygon: Polygon) -> float:
    """Area of a polygon, whichever way round its corners run."""
    doubled = 0.0
    x0, y0 = polygon[-1] if polygon else (0.0, 0.0)
    for x, y in polygon:
        doubled += x0 * y - x * y0
        x0, y0 = x, y
    return abs(doubled) / 2


def mapped(polygon: Polygon, homography: Floats) -> Polygon:
    """A polygon that lies in front of the horizon of `homography` (3, 3), in the other image."""
    if not polygon:
        return []
    x, y, w = homography @ np.column_stack((polygon, np.ones(len(polygon)))).T
    return list(zip((x / w).tolist(), (y / w).tolist(), strict=True))


def corners(polygon: Polygon) -> Floats:
    """A polygon as an array (k, 2)."""
    return np.array(polygon, np.float64).reshape(-1, 2)


def _cut_once(polygon: Polygon, a: float, b: float, c: float) -> Polygon:
    kept: Polygon = []
    x0, y0 = polygon[-1]
    side0 = a * x0 + b * y0 + c
    for x, y in polygon:
        side = a * x + b * y + c
        if (side0 < 0) != (side < 0):
            share = side0 / (side0 - side)
            kept.append((x0 + share * (x - x0), y0 + share * (y - y0)))
        if side >= 0:
            kept.append((x, y))
        x0, y0, side0 = x, y, side
    return kept
