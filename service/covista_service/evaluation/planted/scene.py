"""What planted swarms look at: planes seen from within, and hills that hide what lies behind them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats

Mask = NDArray[np.bool_]

# Cameras see this far: rays end here, and what is further away is in nobody's image.
RANGE_M = 20.0
_CELL_M = 0.5
_STEP_M = 0.2
_HALVINGS = 12
# A surface hides a point only if it stands so far above the way to it.
_CLEAR_M = 0.02


class Scene(Protocol):
    """Surfaces that rays meet."""

    def meet(self, eyes_m: Floats, rays: Floats) -> Floats:
        """How far, in lengths of its ray (n, 3), each eye (n, 3) sees; inf where a ray meets nothing."""

    def open(self, points_m: Floats, eye_m: Floats, /) -> Mask:
        """Which of the points (n, 3), that lie on surfaces, nothing hides from an eye (3,)."""

    def height_m(self, x: float, y: float, /) -> float:
        """Where the ground is under a robot."""


@dataclass(frozen=True, slots=True, eq=False)
class Planes:
    """Planes normal . X = offset, seen by eyes with normal . X > offset: a floor, a wall, two facing walls.

    `normals` (k, 3) of unit length, `offsets_m` (k,). What lies within is convex, so nothing hides anything.
    """

    normals: Floats
    offsets_m: Floats

    def meet(self, eyes_m: Floats, rays: Floats) -> Floats:
        """How far each eye sees."""
        above = eyes_m @ self.normals.T - self.offsets_m
        towards = -(rays @ self.normals.T)
        far = np.where(towards > 0, above / np.where(towards > 0, towards, 1.0), np.inf).min(axis=1)
        return np.where(far * np.linalg.norm(rays, axis=1) <= RANGE_M, far, np.inf)

    def open(self, points_m: Floats, _eye_m: Floats, /) -> Mask:
        """All of them."""
        return np.ones(len(points_m), np.bool_)

    def height_m(self, _x: float, _y: float, /) -> float:
        """Level, whether there is a floor or not."""
        return 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Hills:
    """A height field: `heights_m` (rows, columns) at corner + (column, row) cells, bilinear between, level beyond."""

    heights_m: Floats
    corner_m: tuple[float, float]

    def meet(self, eyes_m: Floats, rays: Floats) -> Floats:
        """How far each eye sees."""
        far: Floats = _meet(self.heights_m, *self.corner_m, eyes_m, rays)
        return far

    def open(self, points_m: Floats, eye_m: Floats) -> Mask:
        """Which points no hill hides."""
        clear: Mask = _open(self.heights_m, *self.corner_m, points_m, eye_m)
        return clear

    def height_m(self, x: float, y: float) -> float:
        """Height of the hills at a place."""
        return float(_height(self.heights_m, *self.corner_m, x, y))


def floor() -> Planes:
    """The plane z = 0, seen from above."""
    return Planes(np.array([[0.0, 0, 1]]), np.zeros(1))


def wall() -> Planes:
    """The plane y = 0, seen from y < 0."""
    return Planes(np.array([[0.0, -1, 0]]), np.zeros(1))


def corridor(width_m: float) -> Planes:
    """Walls at y = 0 and y = -width, seen from between them."""
    return Planes(np.array([[0.0, -1, 0], [0, 1, 0]]), np.array([0.0, -width_m]))


def hills(rng: np.random.Generator, side_m: float, rise_m: float, wide_m: float) -> Hills:
    """Hills over a square from the origin and a margin: `rise_m` is their standard deviation, `wide_m` their width."""
    margin = 4 * wide_m
    cells = math.ceil((side_m + 2 * margin) / _CELL_M) + 1
    rough = gaussian_filter(rng.standard_normal((cells, cells)), wide_m / _CELL_M, mode="wrap")
    return Hills(rough * (rise_m / rough.std()), (-margin, -margin))


@compiled
def _height(heights: Floats, x0: float, y0: float, x: float, y: float) -> float:
    rows, columns = heights.shape
    u = min(max((x - x0) / _CELL_M, 0.0), columns - 1.001)
    v = min(max((y - y0) / _CELL_M, 0.0), rows - 1.001)
    i, j = int(v), int(u)
    b, a = v - i, u - j
    low = (1 - a) * heights[i, j] + a * heights[i, j + 1]
    high = (1 - a) * heights[i + 1, j] + a * heights[i + 1, j + 1]
    height: float = (1 - b) * low + b * high
    return height


@compiled
def _meet(heights: Floats, x0: float, y0: float, eyes: Floats, rays: Floats) -> Floats:
    far = np.full(len(rays), np.inf)
    top = heights.max()
    for k in range(len(rays)):
        x, y, z = eyes[k]
        dx, dy, dz = rays[k]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        step = _STEP_M / length
        before = 0.0
        while before * length < RANGE_M:
            after = before + step
            height = z + after * dz
            if dz >= 0 and height > top:
                break
            if height < _height(heights, x0, y0, x + after * dx, y + after * dy):
                for _ in range(_HALVINGS):
                    middle = (before + after) / 2
                    if z + middle * dz < _height(heights, x0, y0, x + middle * dx, y + middle * dy):
                        after = middle
                    else:
                        before = middle
                far[k] = before
                break
            before = after
    return far


@compiled
def _open(heights: Floats, x0: float, y0: float, points: Floats, eye: Floats) -> Mask:
    clear = np.ones(len(points), np.bool_)
    for k in range(len(points)):
        x, y, z = points[k]
        dx, dy, dz = eye[0] - x, eye[1] - y, eye[2] - z
        steps = int(math.sqrt(dx * dx + dy * dy + dz * dz) / _STEP_M) + 1
        for n in range(1, steps):
            t = n / steps
            if z + t * dz + _CLEAR_M < _height(heights, x0, y0, x + t * dx, y + t * dy):
                clear[k] = False
                break
    return clear
