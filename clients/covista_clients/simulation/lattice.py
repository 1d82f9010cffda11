"""Ways around obstacles: a lattice of free points in a court, and smooth routes along it."""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_clients.simulation.world import Court, Floats, to_obstacles_m

SPACING_M = 0.4
# A route leaves its lattice points by half a diagonal (0.28 m) at most, so it never touches an obstacle.
CLEARANCE_M = 0.35
_SAMPLES_PER_CORNER = 6
Node = tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """Points origin + (column, row) x spacing; `free` (rows, columns) marks those that reach one another."""

    origin_m: Floats
    free: NDArray[np.bool_]


def lattice(court: Court) -> Lattice:
    """The points of a court that keep off its obstacles: the largest connected part of them."""
    columns, rows = ((court.upper_m - court.lower_m) / SPACING_M).astype(int) + 1
    y, x = np.mgrid[0:rows, 0:columns]
    points = court.lower_m + SPACING_M * np.stack([x.ravel(), y.ravel()], axis=1)
    free = (to_obstacles_m(court, points) >= CLEARANCE_M).reshape(rows, columns)
    _, part = cv2.connectedComponents(free.astype(np.uint8), connectivity=8)
    sizes = np.bincount(part[free])
    return Lattice(court.lower_m, free & (part == int(sizes.argmax())))


def nearest_free(grid: Lattice, place_m: Floats) -> Node:
    """The free point (column, row) nearest to a place (2,)."""
    rows, columns = np.nonzero(grid.free)
    best = int(np.hypot(*(place(grid, (columns, rows)).T - place_m[:, None])).argmin())
    return int(columns[best]), int(rows[best])


def place(grid: Lattice, node: tuple[int, int] | tuple[NDArray[np.intp], NDArray[np.intp]]) -> Floats:
    """Metres (2,) or (n, 2) of points given by column and row."""
    return np.asarray(grid.origin_m + SPACING_M * np.stack(node, axis=-1), np.float64)


def route(grid: Lattice, start: Node, goal: Node) -> Floats:
    """A smooth way (n, 2) in metres between free points: the quadratic B-spline of the shortest lattice path."""
    corners = np.array([place(grid, node) for node in _shortest(grid, start, goal)])
    if len(corners) < 3:
        return corners
    middles = (corners[1:] + corners[:-1]) / 2
    t = (np.arange(_SAMPLES_PER_CORNER) / _SAMPLES_PER_CORNER)[:, None]
    arcs = [
        (1 - t) ** 2 * before + 2 * t * (1 - t) * corner + t**2 * after
        for before, corner, after in zip(middles[:-1], corners[1:-1], middles[1:], strict=True)
    ]
    return np.concatenate([corners[:1], *arcs, middles[-1:], corners[-1:]])


def _shortest(grid: Lattice, start: Node, goal: Node) -> list[Node]:
    """A* over the eight neighbours; free points reach one another, so there is a way."""
    cost = {start: 0.0}
    came: dict[Node, Node] = {}
    waiting = [(0.0, start)]
    while waiting:
        _, node = heapq.heappop(waiting)
        if node == goal:
            break
        for step in _STEPS:
            there = (node[0] + step[0], node[1] + step[1])
            if not _is_free(grid, there):
                continue
            through = cost[node] + math.hypot(*step)
            if through < cost.get(there, math.inf) - 1e-9:
                cost[there], came[there] = through, node
                heapq.heappush(waiting, (through + math.dist(there, goal), there))
    path = [goal]
    while path[-1] != start:
        path.append(came[path[-1]])
    return path[::-1]


def _is_free(grid: Lattice, node: Node) -> bool:
    rows, columns = grid.free.shape
    return 0 <= node[0] < columns and 0 <= node[1] < rows and bool(grid.free[node[1], node[0]])


_STEPS = tuple(step for step in itertools.product((-1, 0, 1), repeat=2) if step != (0, 0))
