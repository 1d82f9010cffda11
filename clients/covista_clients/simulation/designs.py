"""What stands where in the small worlds: a facade, a corner, boxes, a shelf. Cameras look towards +y."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from covista_clients.simulation.building import Panel, Side, Solid, faces, ground
from covista_clients.simulation.textures import Material, concrete, gravel, painted, planks, rubble
from covista_clients.simulation.world import Court, Floats

_WALL_THICKNESS_M = 0.3
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Design:
    """A world before it is built."""

    panels: tuple[Panel, ...]
    solids: tuple[Solid, ...]
    courts: tuple[Court, ...]


def wall(start_m: Point, end_m: Point, height_m: float, material: Material, foot_m: float = 0.0) -> Solid:
    """A wall whose face runs from start to end and is seen from the right of that way; its back cannot be seen."""
    (x0, y0), (x1, y1) = start_m, end_m
    yaw = math.atan2(y1 - y0, x1 - x0)
    back = _WALL_THICKNESS_M / 2
    x, y = (x0 + x1) / 2 - math.sin(yaw) * back, (y0 + y1) / 2 + math.cos(yaw) * back
    size = (math.hypot(x1 - x0, y1 - y0), _WALL_THICKNESS_M, height_m)
    return Solid((x, y, foot_m), size, material, yaw, ("front",))


def court(lower_m: Point, upper_m: Point, obstacles: Iterable[Solid], watched: Iterable[Solid]) -> Court:
    """The ground plan: rovers drive around `obstacles` and look at the upright sides of `watched`."""
    footprints = [solid.footprint for solid in obstacles]
    sights = [sight for solid in watched for sight in _sights(solid)]
    return Court(
        np.array(lower_m, np.float64),
        np.array(upper_m, np.float64),
        np.array(footprints, np.float64).reshape(-1, 5),
        np.array(sights, np.float64).reshape(-1, 5),
    )


def facade(rng: np.random.Generator) -> Design:
    """One wall with thin items on it."""
    front = wall((-8.0, 0.0), (8.0, 0.0), 6.0, rubble, foot_m=-1.8)
    items = []
    for x in np.linspace(-4.4, 4.4, 7):
        width, height = rng.uniform(0.4, 0.9), rng.uniform(0.4, 0.8)
        z = rng.uniform(0.3, 1.6)
        thick = rng.uniform(0.03, 0.08)
        base = (float(x + rng.uniform(-0.25, 0.25)), -thick / 2, float(z))
        material = (painted, planks)[int(rng.integers(2))]
        items.append(Solid(base, (width, thick, height), material, 0.0, (*_AROUND, "bottom")))
    return Design((), (front, *items), (_from_south(court((-4.0, -5.0), (4.0, -0.8), (), (front, *items))),))


def corner(rng: np.random.Generator) -> Design:
    """A floor and two walls that meet."""
    floor = ground((-4.6, -7.0), (4.6, 2.2), gravel)
    edge = (float(rng.uniform(-0.3, 0.3)), 2.1)
    left = wall((-4.4, -2.3), edge, 3.2, rubble)
    right = wall(edge, (4.4, -2.3), 3.2, concrete)
    sights = [(edge[0], edge[1], 0.6, 0.0, -1.0)]
    for solid in (left, right):
        normal = next(iter(faces(solid))).normal
        sights += [
            (*(np.array(edge) + along * _from(edge, solid)).tolist(), 0.6, normal[0], normal[1]) for along in (0.9, 1.8)
        ]
    plan = Court(np.array((-2.4, -3.5)), np.array((2.4, 0.2)), np.empty((0, 5)), np.array(sights))
    return Design((floor,), (left, right), (plan,))


def boxes(rng: np.random.Generator) -> Design:
    """Boxes on a floor before a wall."""
    floor = ground((-5.5, -6.5), (5.5, 0.3), gravel)
    back = wall((-5.5, 0.0), (5.5, 0.0), 3.0, rubble)
    standing = []
    for k, x in enumerate((-3.4, -1.9, -0.3, 1.3, 2.9)):
        size = (rng.uniform(0.6, 1.1), rng.uniform(0.5, 0.9), rng.uniform(0.5, 1.5))
        base = (x + rng.uniform(-0.2, 0.2), rng.uniform(-1.9, -0.9), 0.0)
        material = (planks, concrete, painted)[k % 3]
        standing.append(Solid(base, size, material, rng.uniform(-0.6, 0.6)))
    stacked = on_top(standing[1], rng, painted)
    plan = court((-4.5, -5.6), (4.5, -1.0), standing, (back, *standing))
    return Design((floor,), (back, *standing, stacked), (_from_south(plan),))


def shelf(rng: np.random.Generator) -> Design:
    """A wall with a shelf on it, and items on its boards."""
    floor = ground((-5.0, -6.0), (5.0, 0.3), gravel)
    back = wall((-5.0, 0.0), (5.0, 0.0), 3.0, concrete)
    depth, half = 0.45, 1.6
    middle = -depth / 2
    boards = [Solid((0, middle, z), (2 * half, depth, 0.05), planks, 0.0, (*_AROUND, "bottom")) for z in _BOARDS_M]
    posts = [Solid((x, middle, 0.0), (0.06, depth, 2.05), planks) for x in (-half - 0.03, 0.0, half + 0.03)]
    items = []
    for z in _BOARDS_M[:-1]:
        x = -half + 0.12
        while x < half - 0.4:
            width, thick = rng.uniform(0.16, 0.4), rng.uniform(0.15, 0.35)
            if not -width - 0.05 < x < 0.05:
                base = (x + width / 2, -depth + 0.06 + thick / 2, z + 0.05)
                material = (painted, painted, concrete, planks)[int(rng.integers(4))]
                items.append(Solid(base, (width, thick, rng.uniform(0.15, 0.4)), material))
            x += width + rng.uniform(0.04, 0.2)
    plan = court((-3.6, -5.2), (3.6, -1.3), (), (back, boards[1], *items))
    return Design((floor,), (back, *boards, *posts, *items), (_from_south(plan),))


_AROUND: tuple[Side, ...] = ("front", "back", "left", "right", "top")
_BOARDS_M = (0.15, 0.65, 1.15, 1.65)
_SIGHT_SPACING_M = 1.5
_SOUTHWARD = 0.7


def _from_south(plan: Court) -> Court:
    """The same court with those sights only that a camera sees looking towards +y: there is nothing behind."""
    return replace(plan, sights=plan.sights[plan.sights[:, 4] < -_SOUTHWARD])


def _from(edge_m: Point, solid: Solid) -> Floats:
    """Unit vector (2,) from an edge along a wall."""
    way = np.array(solid.base_m[:2]) - edge_m
    return np.asarray(way / np.linalg.norm(way), np.float64)


def on_top(below: Solid, rng: np.random.Generator, material: Material) -> Solid:
    """A smaller block on a block, a little turned."""
    x, y, _ = below.base_m
    length, width, height = below.size_m
    size = (length * rng.uniform(0.4, 0.7), width * rng.uniform(0.4, 0.7), rng.uniform(0.25, 0.5))
    return Solid((x, y, height), size, material, below.yaw_rad + rng.uniform(-0.5, 0.5))


def _sights(solid: Solid) -> Iterable[tuple[float, float, float, float, float]]:
    for panel in faces(solid):
        if abs(panel.normal[2]) > 0.5:
            continue
        width = panel.extent_m[0]
        count = max(1, round(width / _SIGHT_SPACING_M))
        middle_z = solid.base_m[2] + solid.size_m[2] / 2
        for share in (np.arange(count) + 0.5) / count:
            x, y, _ = panel.corner_m + panel.right * width * share
            yield float(x), float(y), float(np.clip(middle_z, 0.4, 0.8)), float(panel.normal[0]), float(panel.normal[1])


def standing_apart(places: Sequence[tuple[float, float, float]], x: float, y: float, radius: float) -> bool:
    """Whether a disc keeps off all discs (x, y, radius) placed before."""
    return all(math.hypot(x - a, y - b) >= radius + r for a, b, r in places)
