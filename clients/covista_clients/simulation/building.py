"""From solids to a world: facets, their textures, shadows on the ground."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_clients.simulation.atlas import GUTTER_PX, Atlas, lay_out, with_levels
from covista_clients.simulation.textures import Material, Picture
from covista_clients.simulation.world import Facets, Floats

# Texels of level 0, all facets together: bounds time to build (about 0.1 s per million) and memory (5 bytes each).
TEXELS = 8_000_000
TEXELS_OF_LARGE_WORLDS = 12_000_000
_LARGE_M2 = 700.0
FINEST_TEXELS_PER_M = 320.0
SUN = np.array((-0.42, -0.5, 0.76)) / np.linalg.norm((-0.42, -0.5, 0.76))
_SHADE = 0.66
_SHADOW = 0.62

Side = Literal["front", "back", "left", "right", "top", "bottom"]
ALL: tuple[Side, ...] = ("front", "back", "left", "right", "top")


@dataclass(frozen=True, slots=True)
class Solid:
    """A block: centre of its base, length (along yaw), width, height in metres, and its sides that can be seen.

    `front` looks along yaw - 90 deg: for yaw 0 towards -y.
    """

    base_m: tuple[float, float, float]
    size_m: tuple[float, float, float]
    material: Material
    yaw_rad: float = 0.0
    sides: tuple[Side, ...] = ALL

    @property
    def footprint(self) -> tuple[float, float, float, float, float]:
        """x, y, half length, half width, yaw."""
        return (self.base_m[0], self.base_m[1], self.size_m[0] / 2, self.size_m[1] / 2, self.yaw_rad)


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One textured rectangle: top left corner, unit right and down, extent in metres."""

    corner_m: Floats
    right: Floats
    down: Floats
    extent_m: tuple[float, float]
    material: Material
    tone: float = 0.5

    @property
    def normal(self) -> Floats:
        """Unit vector towards who sees the panel upright."""
        (a, b, c), (x, y, z) = self.down.tolist(), self.right.tolist()
        return np.array((b * z - c * y, c * x - a * z, a * y - b * x))


def ground(lower_m: tuple[float, float], upper_m: tuple[float, float], material: Material) -> Panel:
    """Level ground at z = 0, seen from above."""
    extent = (upper_m[0] - lower_m[0], upper_m[1] - lower_m[1])
    corner = np.array((lower_m[0], upper_m[1], 0.0))
    return Panel(corner, np.array((1.0, 0, 0)), np.array((0, -1.0, 0)), extent, material)


def faces(solid: Solid, tone: float = 0.5) -> Iterator[Panel]:
    """The visible sides of a block."""
    length, width, height = solid.size_m
    c, s = math.cos(solid.yaw_rad), math.sin(solid.yaw_rad)
    ahead, left, up = np.array((c, s, 0.0)), np.array((-s, c, 0.0)), np.array((0, 0, 1.0))
    middle = np.array(solid.base_m) + up * height / 2
    # Outward normal, right, down, and the extents along normal, right and down of every side.
    frames = {
        "front": (-left, ahead, -up, (width, length, height)),
        "back": (left, -ahead, -up, (width, length, height)),
        "right": (ahead, left, -up, (length, width, height)),
        "left": (-ahead, -left, -up, (length, width, height)),
        "top": (up, ahead, -left, (height, length, width)),
        "bottom": (-up, ahead, left, (height, length, width)),
    }
    for side in solid.sides:
        normal, right, down, (deep, wide, tall) = frames[side]
        corner = middle + normal * deep / 2 - right * wide / 2 - down * tall / 2
        yield Panel(corner, right, down, (wide, tall), solid.material, tone)


def assemble(panels: Sequence[Panel], solids: Sequence[Solid], rng: np.random.Generator) -> tuple[Facets, Atlas]:
    """Facets and textures of panels and of the sides of solids; solids throw shadows on level panels at z = 0."""
    tones = rng.random(len(solids)).tolist()
    every = [*panels, *(face for solid, tone in zip(solids, tones, strict=True) for face in faces(solid, tone))]
    facets = Facets(
        np.array([panel.corner_m for panel in every]),
        np.array([panel.right for panel in every]),
        np.array([panel.down for panel in every]),
        np.array([panel.normal for panel in every]),
        np.array([panel.extent_m for panel in every]),
    )
    area_m2 = float(facets.extent_m.prod(axis=1).sum())
    texels = TEXELS if area_m2 < _LARGE_M2 else TEXELS_OF_LARGE_WORLDS
    texels_per_m = min(FINEST_TEXELS_PER_M, math.sqrt(texels / area_m2))
    layout = lay_out(facets.extent_m, texels_per_m)
    pictures = [
        _painted(panel, height, width, texels_per_m, solids, child)
        for panel, (width, height), child in zip(every, layout.size_px.tolist(), rng.spawn(len(every)), strict=True)
    ]
    return facets, with_levels(layout, pictures, texels_per_m)


def _painted(
    panel: Panel, height: int, width: int, texels_per_m: float, solids: Sequence[Solid], rng: np.random.Generator
) -> Picture:
    picture = panel.material(rng, height, width, texels_per_m, panel.tone)
    sunlight = max(0.0, float(panel.normal @ SUN))
    shade = _SHADE + (1 - _SHADE) * sunlight / SUN[2]
    if panel.normal[2] > 0.5 and panel.corner_m[2] == 0.0:
        shadow = _shadow(panel, picture.shape[:2], texels_per_m, solids)
        return np.asarray(cv2.multiply(picture, cv2.merge([shadow] * 3), scale=shade / 255), np.uint8)
    return np.asarray(cv2.convertScaleAbs(picture, alpha=shade), np.uint8)


def _shadow(panel: Panel, shape: tuple[int, int], texels_per_m: float, solids: Iterable[Solid]) -> Picture:
    """How much light the ground gets, (h, w) uint8: shadows of solids along the sun, with soft rims."""
    coarse = 4
    light = np.full((shape[0] // coarse + 1, shape[1] // coarse + 1), 255, np.uint8)
    frame = np.stack([panel.right, panel.down])
    for solid in solids:
        fallen_m = _fallen(solid) - panel.corner_m
        texels = (fallen_m @ frame.T * texels_per_m + GUTTER_PX) / coarse
        hull = cv2.convexHull(texels.astype(np.float32))
        cv2.fillConvexPoly(light, np.rint(hull).astype(np.int32), round(255 * _SHADOW))
    soft_px = max(1, round(0.05 * texels_per_m / coarse)) * 2 + 1
    soft = cv2.blur(light, (soft_px, soft_px))
    return np.asarray(cv2.resize(soft, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR), np.uint8)


def _fallen(solid: Solid) -> NDArray[np.float64]:
    """Corners (8, 3) of a block moved along the sun's rays to z = 0."""
    x, y, half_length, half_width, yaw = solid.footprint
    c, s = math.cos(yaw), math.sin(yaw)
    ahead, left = np.array((c, s, 0.0)) * half_length, np.array((-s, c, 0.0)) * half_width
    ring = np.array((x, y, 0.0)) + np.array([ahead + left, ahead - left, -ahead + left, -ahead - left])
    heights = (solid.base_m[2], solid.base_m[2] + solid.size_m[2])
    return np.concatenate([ring - z * SUN / SUN[2] * (1, 1, 0) for z in heights])
