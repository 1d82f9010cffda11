"""Plane sweep: how alike small grey images are if a keyframe showed planes parallel to it, one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Camera, Floats

Singles = NDArray[np.float32]
# Of a glimpse that a window fits into.
LEAST_SIDE = 5
_REACH = 2  # of the window: 5 x 5
_SHARE = np.float32(1 / 25)
# Less than any correlation: 1 is reached with rounding.
_UNSEEN = np.float32(-4)
_AHEAD = np.float32(1e-9)
_ZERO = np.float32(0)


@dataclass(frozen=True, slots=True, eq=False)
class Glimpse:
    """A small grey image (h, w) without distortion, and the `matrix` (3, 3) of its ideal camera.

    No side is less than LEAST_SIDE.
    """

    grey: Singles
    matrix: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Beside:
    """What another keyframe shows, with X_other = R X + t."""

    glimpse: Glimpse
    rotation: Floats
    translation: Floats


def glimpse(thumbnail: NDArray[np.uint8], camera: Camera) -> Glimpse:
    """The thumbnail (h, w) of a camera's image, as its ideal camera would have taken it."""
    height, width = thumbnail.shape
    across, down = width / camera.width, height / camera.height
    # Pixel centres are at integers, so that scaling moves them by half a pixel.
    matrix = np.array([[across, 0, across / 2 - 0.5], [0, down, down / 2 - 0.5], [0, 0, 1]]) @ camera.matrix
    if camera.distortion == "none":
        return Glimpse(thumbnail.astype(np.float32), matrix)
    chosen = cv2.initUndistortRectifyMap if camera.distortion == "plumb_bob" else cv2.fisheye.initUndistortRectifyMap
    coefficients = np.array(camera.coefficients, np.float64)
    across_map, down_map = chosen(matrix, coefficients, np.eye(3), matrix, (width, height), cv2.CV_32FC1)
    ideal = cv2.remap(thumbnail, across_map, down_map, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return Glimpse(ideal.astype(np.float32), matrix)


def transfer(first: Glimpse, other: Beside) -> Floats:
    """Matrix (3, 4) that takes (x, y, 1, inverse depth) of the first glimpse to the other, up to scale."""
    camera = other.glimpse.matrix
    return np.column_stack((camera @ other.rotation @ np.linalg.inv(first.matrix), camera @ other.translation))


def likeness(first: Glimpse, others: Sequence[Beside], inverse_depths: Floats, noise: float) -> Singles:
    """How alike (L, h, w), from -1 to 1, the images are where each pixel had each of L inverse depths.

    Zero-mean normalised cross-correlation over 5 x 5 pixels, the mean of the best two of all `others` that see the
    pixel; 0, which says nothing, where none does. `noise` in grey levels keeps what has no texture near 0.
    """
    labels = inverse_depths.astype(np.float32)
    mean, weight = _moments(first.grey, np.float32(noise**2))
    found = np.empty((len(others), len(labels), *first.grey.shape), np.float32)
    for other, correlation in zip(others, found, strict=True):
        forth = transfer(first, other).astype(np.float32)
        _correlate(first.grey, mean, weight, other.glimpse.grey, forth, labels, np.float32(noise**2), correlation)
    return _best_two(found.reshape(len(others), -1)).reshape(found.shape[1:])


@compiled
def _correlate(
    first: Singles,
    mean: Singles,
    weight: Singles,
    second: Singles,
    forth: Singles,
    rho: Singles,
    floor: np.float32,
    found: Singles,
) -> None:
    """Fills `found` (L, h, w) with the correlation with one other image; `forth` (3, 4) takes (x, y, 1, rho) there."""
    height, width = first.shape
    moved, inside = np.empty_like(first), np.empty(first.shape, np.bool_)
    columns = np.empty((3, width + 2 * _REACH), np.float32)
    sums = np.empty((3, width), np.float32)
    for k in range(len(rho)):
        _warp(second, forth, rho[k], moved, inside)
        for y in range(height):
            _window_sums(first, moved, y, columns, sums)
            for x in range(width):
                middle = sums[0, x] * _SHARE
                variance = sums[1, x] * _SHARE - middle * middle
                variance = (variance if variance > 0 else _ZERO) + floor
                alike = (sums[2, x] * _SHARE - middle * mean[y, x]) * weight[y, x]
                alike = np.divide(alike, np.sqrt(variance))
                found[k, y, x] = alike if inside[y, x] else _UNSEEN


@compiled
def _warp(second: Singles, forth: Singles, rho: np.float32, moved: Singles, inside: NDArray[np.bool_]) -> None:
    """`moved` is the second image as the first camera would see it on the plane; beyond its border it goes on."""
    height, width = moved.shape
    places = np.empty((2, width), np.float32)
    for y in range(height):
        _places(forth, rho, np.float32(y), second.shape, places, inside[y])
        _sample(second, places, moved[y])


@compiled
def _places(
    forth: Singles,
    rho: np.float32,
    y: np.float32,
    shape: tuple[int, int],
    places: Singles,
    inside: NDArray[np.bool_],
) -> None:
    """Where a row's pixels (2, w) lie in the second image, drawn to its border, and which were within it."""
    half = np.float32(0.5)
    right, bottom = np.float32(shape[1] - 1), np.float32(shape[0] - 1)
    u0 = forth[0, 1] * y + forth[0, 2] + rho * forth[0, 3]
    v0 = forth[1, 1] * y + forth[1, 2] + rho * forth[1, 3]
    w0 = forth[2, 1] * y + forth[2, 2] + rho * forth[2, 3]
    for x in range(places.shape[1]):
        w = w0 + forth[2, 0] * np.float32(x)
        scale = np.divide(np.float32(1), w if w > _AHEAD else _AHEAD)
        u, v = (u0 + forth[0, 0] * np.float32(x)) * scale, (v0 + forth[1, 0] * np.float32(x)) * scale
        inside[x] = (w > _AHEAD) & (-half <= u) & (u <= right + half) & (-half <= v) & (v <= bottom + half)
        u, v = u if u > _ZERO else _ZERO, v if v > _ZERO else _ZERO
        places[0, x], places[1, x] = u if u < right else right, v if v < bottom else bottom


@compiled
def _sample(image: Singles, places: Singles, values: Singles) -> None:
    """Bilinear values (w,) at places (2, w) within the image."""
    # Unsigned, or every index would be tested for being negative.
    one, last = np.uint64(1), np.uint64(image.shape[1] - 2)
    below, lowest = np.uint64(image.shape[1]), np.uint64(image.shape[0] - 2)
    flat = image.ravel()
    for x in range(len(values)):
        u, v = places[0, x], places[1, x]
        j, i = min(np.uint64(u), last), min(np.uint64(v), lowest)
        across, down = u - np.float32(j), v - np.float32(i)
        at = i * below + j
        upper = flat[at] + across * (flat[at + one] - flat[at])
        lower = flat[at + below] + across * (flat[at + below + one] - flat[at + below])
        values[x] = upper + down * (lower - upper)


@compiled
def _window_sums(first: Singles, moved: Singles, y: int, columns: Singles, sums: Singles) -> None:
    """Sums (3, w) over the windows of a row: what is moved, its square, its product with the first image.

    Beyond the border both images go on as they end.
    """
    height, width = moved.shape
    columns[:] = 0
    for dy in range(-_REACH, _REACH + 1):
        r = min(max(y + dy, 0), height - 1)
        for x in range(width):
            grey = moved[r, x]
            columns[0, x + _REACH] += grey
            columns[1, x + _REACH] += grey * grey
            columns[2, x + _REACH] += grey * first[r, x]
    for q in range(3):
        for x in range(_REACH):
            columns[q, x] = columns[q, _REACH]
            columns[q, width + _REACH + x] = columns[q, width + _REACH - 1]
        for x in range(width):
            sums[q, x] = columns[q, x] + columns[q, x + 1] + columns[q, x + 2] + columns[q, x + 3] + columns[q, x + 4]


@compiled
def _moments(grey: Singles, floor: np.float32) -> tuple[Singles, Singles]:
    """Mean (h, w) of each pixel's window, and one over its deviation."""
    height, width = grey.shape
    mean, weight = np.empty_like(grey), np.empty_like(grey)
    columns = np.empty((3, width + 2 * _REACH), np.float32)
    sums = np.empty((3, width), np.float32)
    for y in range(height):
        _window_sums(grey, grey, y, columns, sums)
        for x in range(width):
            mean[y, x] = sums[0, x] * _SHARE
            variance = max(sums[1, x] * _SHARE - mean[y, x] * mean[y, x], _ZERO)
            weight[y, x] = np.float32(1) / np.sqrt(variance + floor)
    return mean, weight


@compiled
def _best_two(found: Singles) -> Singles:
    """Mean (n,) of the two largest of (k, n) that are seen."""
    best, second = np.full(found.shape[1], _UNSEEN), np.full(found.shape[1], _UNSEEN)
    for c in range(found.shape[0]):
        for n in range(found.shape[1]):
            value = found[c, n]
            less = value if value < best[n] else best[n]
            best[n] = value if value > best[n] else best[n]
            second[n] = less if less > second[n] else second[n]
    for n in range(found.shape[1]):
        both = np.float32(0.5) * (best[n] + second[n]) if second[n] > _UNSEEN else best[n]
        best[n] = both if best[n] > _UNSEEN else _ZERO
    return best
