"""The arena: walled courts of 12 m x 12 m with boxes, pillars and a free-standing wall; one court per six rovers."""

from __future__ import annotations

import math

import numpy as np

from covista_clients.simulation.building import Solid, ground
from covista_clients.simulation.designs import Design, Point, court, on_top, standing_apart, wall
from covista_clients.simulation.textures import Material, concrete, gravel, painted, planks, rubble
from covista_clients.simulation.world import Court

SIDE_M = 12.0
ROVERS_PER_COURT = 6
_HEIGHT_M = 2.6
_THICK_M = 0.3
# Doorways at the corners of neighbouring courts.
_DOOR_M = 1.6
_GAP_M = 0.75
_KEEP_OFF_WALL_M = 0.75
# Least and most size of what stands around: length, width, height.
_THINGS: tuple[tuple[tuple[float, float, float], tuple[float, float, float], Material], ...] = (
    ((2.4, 0.25, 1.7), (2.8, 0.25, 2.0), rubble),
    ((1.0, 0.7, 0.8), (1.6, 1.1, 1.4), planks),
    ((0.9, 0.8, 0.8), (1.4, 1.2, 1.6), concrete),
    ((0.7, 0.7, 1.0), (1.1, 1.0, 1.5), painted),
    ((0.8, 0.6, 0.7), (1.3, 0.9, 1.1), planks),
    ((0.45, 0.45, 2.2), (0.55, 0.55, 2.6), concrete),
    ((0.45, 0.45, 2.2), (0.55, 0.55, 2.6), concrete),
)


def arena(rng: np.random.Generator, robots: int) -> Design:
    """As many courts, side by side, as `robots` need."""
    count = max(1, -(-robots // ROVERS_PER_COURT))
    columns = math.isqrt(count - 1) + 1
    rows = -(-count // columns)
    size = (columns * SIDE_M, rows * SIDE_M)
    solids = list(_perimeter(*size))
    courts: list[Court] = []
    for row in range(rows):
        for column in range(columns):
            lower = (column * SIDE_M, row * SIDE_M)
            inner = [
                _between(lower, axis) for axis, last in ((0, columns - 1), (1, rows - 1)) if _more(lower, axis, last)
            ]
            standing = _things(rng, lower)
            solids += [*inner, *standing, on_top(standing[1], rng, painted)]
            if len(courts) < count:
                courts.append(_court(lower, standing))
    return Design((ground((0.0, 0.0), size, gravel),), tuple(solids), tuple(courts))


def _perimeter(width: float, depth: float) -> tuple[Solid, ...]:
    corners = ((0.0, depth), (width, depth), (width, 0.0), (0.0, 0.0))
    ways = zip(corners, (*corners[1:], corners[0]), strict=True)
    return tuple(wall(start, end, _HEIGHT_M, rubble) for start, end in ways)


def _more(lower: Point, axis: int, last: int) -> bool:
    return round(lower[axis] / SIDE_M) < last


def _between(lower: Point, axis: int) -> Solid:
    """The wall between a court and the next one along `axis`, with doorways at both ends."""
    middle = [lower[0] + SIDE_M / 2, lower[1] + SIDE_M / 2]
    middle[axis] += SIDE_M / 2
    yaw = math.pi / 2 if axis == 0 else 0.0
    return Solid((middle[0], middle[1], 0.0), (SIDE_M - 2 * _DOOR_M, _THICK_M, _HEIGHT_M), rubble, yaw)


def _things(rng: np.random.Generator, lower: Point) -> list[Solid]:
    placed: list[tuple[float, float, float]] = []
    things = []
    for least, most, material in _THINGS:
        length, width, height = (rng.uniform(a, b) for a, b in zip(least, most, strict=True))
        radius = math.hypot(length, width) / 2 + _GAP_M
        x, y = _free_place(rng, lower, radius, placed)
        placed.append((x, y, radius))
        things.append(Solid((x, y, 0.0), (length, width, height), material, rng.uniform(0, math.pi)))
    return things


def _free_place(
    rng: np.random.Generator, lower: Point, radius: float, placed: list[tuple[float, float, float]]
) -> Point:
    margin = radius + _KEEP_OFF_WALL_M
    # Seven things leave room to spare: a place is found after a few draws.
    while True:
        x, y = (float(edge + rng.uniform(margin, SIDE_M - margin)) for edge in lower)
        if standing_apart(placed, x, y, radius):
            return x, y


def _court(lower: Point, standing: list[Solid]) -> Court:
    """Rovers of a court keep off its borders, walled or not, and look at them from inside."""
    x, y = lower
    face = _THICK_M / 2
    a, b, c, d = (x, y), (x + SIDE_M, y), (x + SIDE_M, y + SIDE_M), (x, y + SIDE_M)
    walls = [wall(start, end, _HEIGHT_M, rubble) for start, end in ((d, c), (c, b), (b, a), (a, d))]
    inside = ((x + 3 * face, y + 3 * face), (x + SIDE_M - 3 * face, y + SIDE_M - 3 * face))
    return court(*inside, standing, (*walls, *standing))
