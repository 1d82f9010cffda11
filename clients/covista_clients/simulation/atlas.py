"""All textures of a world in one picture, with its mip levels beside it, so that a frame is a few calls of remap.

Level 0 stands at (0, 0); level l >= 1 is smaller by 2^l and stands to the right of it, one below the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_clients.simulation.textures import Picture

LEVELS = 6
GUTTER_PX = 8
_ALIGN = 1 << (LEVELS - 1)


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """`image` (H, W, 3) BGR; texel (0, 0) of patch k is at `patch_px[k]`; level l stands at `level_px[l]`."""

    image: Picture
    texels_per_m: float
    patch_px: NDArray[np.float32]
    level_px: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Where patches lie: `corner_px` (n, 2) and `size_px` (n, 2) as (x, y), gutters included, in `width` x `height`."""

    corner_px: NDArray[np.int64]
    size_px: NDArray[np.int64]
    width: int
    height: int

    def slots(self) -> Iterator[tuple[slice, slice]]:
        """Rows and columns of every patch."""
        for (x, y), (w, h) in zip(self.corner_px.tolist(), self.size_px.tolist(), strict=True):
            yield slice(y, y + h), slice(x, x + w)


def lay_out(extent_m: NDArray[np.float64], texels_per_m: float) -> Layout:
    """Place patches of (n, 2) metres on shelves, tallest first."""
    size = np.ceil(extent_m * texels_per_m).astype(np.int64) + 2 * GUTTER_PX
    width = _aligned(max(int(size[:, 0].max()), int(np.sqrt(size.prod(axis=1).sum()))))
    corner = np.zeros_like(size)
    x = y = shelf = 0
    for k in np.lexsort((np.arange(len(size)), -size[:, 1])):
        if x + size[k, 0] > width:
            x, y, shelf = 0, y + shelf, 0
        corner[k] = x, y
        x, shelf = x + int(size[k, 0]), max(shelf, int(size[k, 1]))
    return Layout(corner, size, width, _aligned(y + shelf))


def with_levels(layout: Layout, patches: Sequence[Picture], texels_per_m: float) -> Atlas:
    """The atlas of painted patches, their mip levels by exact 2 x 2 means."""
    width, height = layout.width, layout.height
    image = np.full((height, width + width // 2, 3), 128, np.uint8)
    for slot, patch in zip(layout.slots(), patches, strict=True):
        image[slot] = patch
    level = image[:, :width]
    places, y = [(0, 0)], 0
    for _ in range(1, LEVELS):
        half = (level.shape[1] // 2, level.shape[0] // 2)
        level = np.asarray(cv2.resize(level, half, interpolation=cv2.INTER_AREA), np.uint8)
        image[y : y + level.shape[0], width : width + level.shape[1]] = level
        places.append((width, y))
        y += level.shape[0]
    return Atlas(
        image,
        texels_per_m,
        (layout.corner_px + GUTTER_PX).astype(np.float32),
        np.array(places, np.float32),
    )


def _aligned(length: int) -> int:
    return (length + _ALIGN - 1) // _ALIGN * _ALIGN
