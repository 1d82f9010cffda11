"""Procedural surfaces with structure on every scale, on which feature detectors find plenty.

A material is a height field, lit from the side, times a colour per pixel. Every call draws new content from its
generator: no patch repeats another, nor itself. `tone` in [0, 1) is what the sides of one solid have in common.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

Field = NDArray[np.float32]
Picture = NDArray[np.uint8]
Material = Callable[[np.random.Generator, int, int, float, float], Picture]


def rubble(rng: np.random.Generator, height_px: int, width_px: int, texels_per_m: float, tone: float) -> Picture:
    """A wall of irregular stones in mortar, (height_px, width_px, 3) BGR uint8."""
    shape = (height_px, width_px)
    stone, rim_px = _cells(rng, shape, 0.36 * texels_per_m, 0.2 * texels_per_m)
    rough = _noise(rng, shape, 0.6 * texels_per_m)
    depth = np.minimum(rim_px * np.float32(24 / texels_per_m), 1.0)
    colour = _tones(rng, stone, base=(118 + 8 * tone, 132, 142), spread=24, tint=5)
    _mortar(colour, rim_px < 0.012 * texels_per_m, (96, 104, 108))
    return _lit(colour, rough * 0.5 + depth * 1.2, rough, gain=52, stain=16)


def gravel(rng: np.random.Generator, height_px: int, width_px: int, texels_per_m: float, tone: float) -> Picture:
    """Sandy ground strewn with pebbles and stones."""
    shape = (height_px, width_px)
    rough = _noise(rng, shape, 2.0 * texels_per_m)
    colour = np.full((*shape, 3), (112 + int(8 * tone), 136, 152), np.uint8)
    relief = rough * 0.55
    for size_m, share, tint in ((0.09, 0.45, 5), (0.3, 0.16, 5)):
        stone, rim_px = _cells(rng, shape, size_m * texels_per_m, size_m * texels_per_m)
        lies_here = (rng.random(int(stone.max()) + 1) < share).take(stone) & (rim_px > 0.008 * texels_per_m)
        tones = _tones(rng, stone, base=(120, 132, 138), spread=34, tint=tint)
        cv2.copyTo(tones, lies_here.view(np.uint8), colour)
        bump = np.sqrt(np.minimum(rim_px * np.float32(2.5 / (size_m * texels_per_m)), 1.0))
        relief += np.where(lies_here, bump * np.float32(1.1), np.float32(0))
    return _lit(colour, relief, rough, gain=48, stain=20)


def concrete(rng: np.random.Generator, height_px: int, width_px: int, texels_per_m: float, tone: float) -> Picture:
    """Cast stone, stained and chipped; its basic colour varies from patch to patch."""
    shape = (height_px, width_px)
    rough = _noise(rng, shape, 1.0 * texels_per_m)
    flake, rim_px = _cells(rng, shape, 0.11 * texels_per_m, 0.11 * texels_per_m)
    chipped = (rng.random(int(flake.max()) + 1) < 0.3).take(flake)
    base = np.array((132, 140, 146)) * (0.85 + 0.3 * tone)
    colour = _tones(rng, np.where(chipped, flake, 0), base=tuple(base), spread=24, tint=3)
    chip = np.minimum(rim_px * np.float32(60 / texels_per_m), 1.0) * chipped
    return _lit(colour, rough * 0.6 - chip * 0.9, rough, gain=46, stain=20)


def planks(rng: np.random.Generator, height_px: int, width_px: int, texels_per_m: float, tone: float) -> Picture:
    """Weathered boards, lying along the longer side."""
    if height_px > width_px:
        return np.ascontiguousarray(planks(rng, width_px, height_px, texels_per_m, tone).transpose(1, 0, 2))
    shape = (height_px, width_px)
    board_px = max(4.0, 0.16 * texels_per_m)
    board = (np.arange(height_px) / board_px).astype(np.int32)
    fibre = _noise(rng, (height_px, max(8, width_px // 6)), 0.1 * texels_per_m)
    grain = np.asarray(cv2.resize(fibre, (width_px, height_px), interpolation=cv2.INTER_CUBIC), np.float32)
    rough = _noise(rng, shape, 0.5 * texels_per_m)
    colour = _tones(rng, np.repeat(board[:, None], width_px, 1), base=(80 + 24 * tone, 124, 150), spread=16, tint=4)
    gap = np.abs((np.arange(height_px) / board_px) % 1.0 - 0.5) > 0.47
    _mortar(colour, np.repeat(gap[:, None], width_px, 1), (48, 58, 66))
    return _lit(colour, grain * 0.7 + rough * 0.5, grain + rough, gain=48, stain=13)


def painted(rng: np.random.Generator, height_px: int, width_px: int, texels_per_m: float, tone: float) -> Picture:
    """Painted metal or card with worn spots, in a colour of its own."""
    shape = (height_px, width_px)
    rough = _noise(rng, shape, 0.4 * texels_per_m)
    spot, _ = _cells(rng, shape, 0.07 * texels_per_m, 0.05 * texels_per_m)
    worn = rng.random(int(spot.max()) + 1) < 0.35
    paint = _PAINTS[int(tone * len(_PAINTS))]
    colour = _tones(rng, np.where(worn.take(spot), spot, 0), base=paint, spread=26, tint=6)
    return _lit(colour, rough * 0.7, rough, gain=44, stain=18)


_PAINTS = ((96, 120, 172), (150, 128, 92), (104, 146, 118), (90, 158, 176), (128, 118, 140), (150, 150, 140))
_FINEST_PX = 2.0


def _noise(rng: np.random.Generator, shape: tuple[int, int], coarsest_px: float) -> Field:
    """Noise of about unit variance, equal power in every octave between `coarsest_px` and the finest texels."""
    octaves = max(1, int(np.log2(max(coarsest_px, 2 * _FINEST_PX) / _FINEST_PX)))
    field: Field = np.zeros((1, 1), np.float32)
    for octave in range(octaves, -1, -1):
        cell_px = _FINEST_PX * 2**octave
        size = (int(shape[1] / cell_px) + 2, int(shape[0] / cell_px) + 2)
        fresh = rng.standard_normal((size[1], size[0]), np.float32)
        field = np.asarray(cv2.resize(field, size, interpolation=cv2.INTER_CUBIC), np.float32) + fresh
    field *= np.float32(1 / np.sqrt(octaves + 1))
    grown = cv2.resize(field, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return np.asarray(grown, np.float32)


def _cells(
    rng: np.random.Generator, shape: tuple[int, int], width_px: float, height_px: float
) -> tuple[NDArray[np.int32], Field]:
    """Voronoi cells of jittered points in offset rows: labels from 1, and distance to the cell's rim in pixels."""
    rows, columns = int(shape[0] / height_px) + 1, int(shape[1] / width_px) + 1
    row, column = np.mgrid[0:rows, 0:columns]
    y = (row + rng.uniform(0.15, 0.85, row.shape)) * height_px
    x = (column + rng.uniform(0.1, 0.9, row.shape) + 0.5 * (row % 2) - 0.25) * width_px
    seeds = np.full(shape, 255, np.uint8)
    seeds[np.clip(y, 0, shape[0] - 1).astype(int), np.clip(x, 0, shape[1] - 1).astype(int)] = 0
    _, label = cv2.distanceTransformWithLabels(seeds, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    inner = np.full(shape, 255, np.uint8)
    inner[:, 1:][label[:, 1:] != label[:, :-1]] = 0
    inner[1:][label[1:] != label[:-1]] = 0
    rim_px = cv2.distanceTransform(inner, cv2.DIST_L2, 3)
    return np.asarray(label, np.int32), np.asarray(rim_px, np.float32)


def _tones(
    rng: np.random.Generator, label: NDArray[np.int32], base: tuple[float, ...], spread: float, tint: float
) -> Picture:
    """One colour per label: `base` (BGR), brighter or darker by `spread`, tinted by `tint`; label 0 is `base`."""
    count = int(label.max()) + 1
    table = np.array(base) + rng.normal(0, spread, (count, 1)) + rng.normal(0, tint, (count, 3))
    table[0] = base
    bytes_ = np.clip(table, 20, 235).astype(np.uint8)
    return np.asarray(cv2.merge([bytes_[:, channel].take(label) for channel in range(3)]), np.uint8)


def _mortar(colour: Picture, where: NDArray[np.bool_], tone: tuple[int, int, int]) -> None:
    cv2.copyTo(np.full_like(colour, tone), where.view(np.uint8), colour)


def _lit(colour: Picture, relief: Field, stains: Field, gain: float, stain: float) -> Picture:
    """`colour` under light from the upper left: slopes of `relief` (1 per texel) brighten or darken."""
    light = np.full(relief.shape, 128, np.float32)
    light[1:, 1:] += gain * (relief[1:, 1:] - relief[:-1, :-1])
    light += stain * stains
    grey = cv2.merge([np.clip(light, 10, 255, out=light).astype(np.uint8)] * 3)
    return np.asarray(cv2.multiply(colour, grey, scale=1 / 128), np.uint8)
