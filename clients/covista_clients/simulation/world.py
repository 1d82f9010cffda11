"""A world as arrays: textured rectangles, and the ground plan that rovers drive by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_clients.simulation.atlas import Atlas

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """Rectangles corner + s right + t down, 0 <= s <= extent[0], 0 <= t <= extent[1]; solid from in front only.

    `corner_m`, unit vectors `right` and `down`, and `normal` = down x right, which points at who sees the rectangle
    upright: all (F, 3), world frame. `extent_m` (F, 2). Solids are closed, so their inner sides need no facet.
    """

    corner_m: Floats
    right: Floats
    down: Floats
    normal: Floats
    extent_m: Floats

    def __len__(self) -> int:
        return len(self.corner_m)


@dataclass(frozen=True, slots=True, eq=False)
class Court:
    """A stretch of ground that some rovers share: where they may drive, and what is worth looking at.

    `lower_m`, `upper_m` (2,): the rectangle free to drive. `obstacles` (n, 5): rectangles x, y, half length, half
    width, yaw. `sights` (k, 5): points x, y, z on surfaces and their horizontal normals x, y.
    """

    lower_m: Floats
    upper_m: Floats
    obstacles: Floats
    sights: Floats


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A world that can be rendered and driven in; the same name and seed give the same world."""

    name: str
    seed: int
    facets: Facets
    atlas: Atlas
    courts: tuple[Court, ...]


def clearance_m(court: Court, points_m: Floats) -> Floats:
    """How far points (n, 2) are from the nearest obstacle and from leaving the court; negative inside or outside."""
    edge = np.minimum(points_m - court.lower_m, court.upper_m - points_m).min(axis=1)
    return np.asarray(np.minimum(edge, to_obstacles_m(court, points_m)), np.float64)


def to_obstacles_m(court: Court, points_m: Floats) -> Floats:
    """How far points (n, 2) are from the nearest obstacle, inf without any; negative inside."""
    x, y, half_length, half_width, yaw = court.obstacles.T[..., None]
    dx, dy = points_m[:, 0] - x, points_m[:, 1] - y
    beyond_x = np.abs(dx * np.cos(yaw) + dy * np.sin(yaw)) - half_length
    beyond_y = np.abs(dy * np.cos(yaw) - dx * np.sin(yaw)) - half_width
    outside = np.hypot(np.maximum(beyond_x, 0), np.maximum(beyond_y, 0))
    distance = outside + np.minimum(np.maximum(beyond_x, beyond_y), 0)
    return np.asarray(distance.min(axis=0, initial=np.inf), np.float64)
