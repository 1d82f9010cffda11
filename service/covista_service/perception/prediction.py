"""Overlaps foretold from known planes and new poses, for many pairs at once: `overlap.common_field` in one pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Camera, Floats
from covista_service.perception.overlap import EDGE_ON

Slices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class PosedPairs:
    """n pairs of cameras and the planes that each knows.

    `sizes_px` (n, 4): width and height of either image; `rays_from_pixels` (n, 3, 3) of the first camera, `matrices`
    (n, 3, 3) of the second; X_2 = R X_1 + t with `rotations` (n, 3, 3) and `translations` (n, 3). `planes` (P, 3) are
    u . X + 1 = 0 in the frames of first cameras, and a pair's own are those from `slices` (n, 2): begin and end.
    """

    sizes_px: Floats
    rays_from_pixels: Floats
    matrices: Floats
    rotations: Floats
    translations: Floats
    planes: Floats
    slices: Slices


def posed_pairs(
    cameras: Sequence[tuple[Camera, Camera]], rotations: Floats, translations: Floats, planes: Sequence[Floats]
) -> PosedPairs:
    """Pairs of cameras with relative poses (n, 3, 3), (n, 3), and planes (K, 3) for each in the first one's frame."""
    ends = np.cumsum([len(known) for known in planes], dtype=np.int64)
    return PosedPairs(
        np.array([(a.width, a.height, b.width, b.height) for a, b in cameras], np.float64).reshape(-1, 4),
        np.array([a.rays_from_pixels for a, _ in cameras], np.float64).reshape(-1, 3, 3),
        np.array([b.matrix for _, b in cameras], np.float64).reshape(-1, 3, 3),
        np.asarray(rotations, np.float64).reshape(-1, 3, 3),
        np.asarray(translations, np.float64).reshape(-1, 3),
        np.vstack((np.zeros((0, 3)), *planes)),
        np.column_stack((np.concatenate(([0], ends[:-1])) if len(ends) else ends, ends)).astype(np.int64),
    )


def overlaps(pairs: PosedPairs) -> Floats:
    """q_1 and q_2 (n, 2) of Eq. 16 on the nearest of each pair's planes; 0 for a pair without a plane."""
    return _overlaps(
        pairs.sizes_px,
        pairs.rays_from_pixels,
        pairs.matrices,
        pairs.rotations,
        pairs.translations,
        pairs.planes,
        pairs.slices,
    )


@compiled
def _overlaps(
    sizes: Floats,
    inverses: Floats,
    matrices: Floats,
    rotations: Floats,
    translations: Floats,
    planes: Floats,
    slices: Slices,
) -> Floats:
    shares = np.zeros((len(sizes), 2))
    most = 1
    for begin, end in slices:
        most = max(most, end - begin)
    # A convex polygon gains at most one corner by each cut.
    corners, spare = np.empty((most + 8, 2)), np.empty((most + 8, 2))
    homography, moved, rho = np.empty((3, 3)), np.empty((3, 3)), np.empty((most, 3))
    for i in range(len(sizes)):
        own = planes[slices[i, 0] : slices[i, 1]]
        width, height, second_width, second_height = sizes[i]
        _multiply(own, inverses[i], rho)  # -rho_k, which takes no sign until compared
        if _parted(own, rotations[i], translations[i]):
            continue
        for k in range(len(own)):
            if _side(own[k], rotations[i], translations[i]) < EDGE_ON:
                continue
            for a in range(3):
                for b in range(3):
                    moved[a, b] = rotations[i, a, b] - translations[i, a] * own[k, b]
            _multiply(_multiply(matrices[i], moved, homography), inverses[i], moved)
            count = _shown(k, rho[: len(own)], width, height, corners, spare)
            count = _within(moved, second_width, second_height, corners, count, spare)
            area, area_second = _areas(corners, count, moved)
            shares[i, 0] += area
            shares[i, 1] += area_second
        shares[i, 0] = min(1.0, shares[i, 0] / (width * height))
        shares[i, 1] = min(1.0, shares[i, 1] / (second_width * second_height))
    return shares


@compiled
def _side(plane: Floats, rotation: Floats, translation: Floats) -> float:
    """1 + u . C_2, positive where both cameras are on the same side."""
    side = 1.0
    for a in range(3):
        for b in range(3):
            side -= plane[a] * rotation[b, a] * translation[b]
    return side


@compiled
def _parted(planes: Floats, rotation: Floats, translation: Floats) -> bool:
    """Is there a plane between the cameras? Then whatever one sees, on it or before it, it hides from the other.

    On plane k, (r2_k - r2_j) . H_k v is (rho_k - rho_j) / (1 + u_j . C_2): with that positive for all planes, nearest
    in one image is nearest in the other; with one negative, nothing is.
    """
    for plane in planes:  # noqa: SIM110 - numba knows no any()
        if _side(plane, rotation, translation) <= -EDGE_ON:
            return True
    return False


@compiled
def _multiply(a: Floats, b: Floats, product: Floats) -> Floats:
    """Fill in the first rows of `product` with a b, for b (3, 3)."""
    for i in range(len(a)):
        for j in range(3):
            product[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return product


@compiled
def _shown(k: int, negative: Floats, width: float, height: float, corners: Floats, spare: Floats) -> int:
    """Fill in the corners of what the first image shows of plane k, where -rho is `negative` (K, 3) times v."""
    right, bottom = width - 0.5, height - 0.5
    corners[0, 0], corners[0, 1], corners[1, 0], corners[1, 1] = -0.5, -0.5, right, -0.5
    corners[2, 0], corners[2, 1], corners[3, 0], corners[3, 1] = right, bottom, -0.5, bottom
    own = negative[k]
    count = _cut(corners, 4, -own[0], -own[1], -own[2], spare)
    for j in range(len(negative)):
        if j != k:
            other = negative[j]
            count = _cut(corners, count, other[0] - own[0], other[1] - own[1], other[2] - own[2], spare)
    return count


@compiled
def _within(H: Floats, width: float, height: float, corners: Floats, count: int, spare: Floats) -> int:
    """Cut a polygon of the first image to what H puts inside the second."""
    for axis, size in ((0, width), (1, height)):
        a, b, c = H[axis, 0] + 0.5 * H[2, 0], H[axis, 1] + 0.5 * H[2, 1], H[axis, 2] + 0.5 * H[2, 2]
        count = _cut(corners, count, a, b, c, spare)
        count = _cut(corners, count, size * H[2, 0] - a, size * H[2, 1] - b, size * H[2, 2] - c, spare)
    return count


@compiled
def _cut(corners: Floats, count: int, a: float, b: float, c: float, spare: Floats) -> int:
    """Keep of a convex polygon what has a x + b y + c >= 0; returns the number of corners left, 0 for less than 3."""
    if count < 3:
        return 0
    spare[:count] = corners[:count]
    kept = 0
    x0, y0 = spare[count - 1]
    side0 = a * x0 + b * y0 + c
    for i in range(count):
        x, y = spare[i]
        side = a * x + b * y + c
        if (side0 < 0) != (side < 0):
            share = side0 / (side0 - side)
            corners[kept, 0], corners[kept, 1] = x0 + share * (x - x0), y0 + share * (y - y0)
            kept += 1
        if side >= 0:
            corners[kept, 0], corners[kept, 1] = x, y
            kept += 1
        x0, y0, side0 = x, y, side
    return kept if kept >= 3 else 0


@compiled
def _areas(corners: Floats, count: int, H: Floats) -> tuple[float, float]:
    """Areas of a polygon, and of what H makes of it."""
    doubled = doubled_mapped = x0 = y0 = u0 = v0 = 0.0
    for i in range(-1, count):
        if count == 0:
            break
        x, y = corners[i if i >= 0 else count - 1]
        w = H[2, 0] * x + H[2, 1] * y + H[2, 2]
        u, v = (H[0, 0] * x + H[0, 1] * y + H[0, 2]) / w, (H[1, 0] * x + H[1, 1] * y + H[1, 2]) / w
        if i >= 0:
            doubled += x0 * y - x * y0
            doubled_mapped += u0 * v - u * v0
        x0, y0, u0, v0 = x, y, u, v
    return abs(doubled) / 2, abs(doubled_mapped) / 2
