"""Where robots of planted groups stand and what they look at."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from covista_service.evaluation.planted import scene as scenes
from covista_service.evaluation.planted.scene import Scene
from covista_service.evaluation.planted.views import Views, looking
from covista_service.perception.camera import Floats

Kind = Literal["ground", "wall", "corridor", "terrain"]
KINDS: tuple[Kind, ...] = ("ground", "wall", "corridor", "terrain")
Labels = NDArray[np.intp]

SIZES = (2, 8)
LONER_SHARE = 0.12
# Ground per robot, and length of wall per robot.
AREA_M2 = 10.0
STRETCH_M = 1.6
CORRIDOR_M = 6.0
_SPREAD_M = 0.65
_JITTER_M = 0.45
# Two groups are told apart by where they stand and what they look at: the squares of both distances, as shares of
# these, add up to one at least.
_SPOT_APART_M = 4.0
_TARGET_APART_M = 5.0
_DRAWS = 200
_HILL_RISE_M, _HILL_WIDTH_M = 0.8, 2.2
# Robots that must stay apart: no place is in the range of two.
_LONELY_M = 2.2 * scenes.RANGE_M


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Cameras before a scene, and the group of each, (N,)."""

    scene: Scene
    views: Views
    truth: Labels


@dataclass(frozen=True, slots=True)
class _Site:
    """A scene, and how to draw a place (x, y) with something to look at (x, y, z) there."""

    scene: Scene
    draw: Callable[[np.random.Generator], tuple[Floats, Floats]]
    eye_m: tuple[float, float]


def planted(rng: np.random.Generator, kind: Kind, count: int) -> Layout:
    """`count` robots in groups of 2 to 8 and some loners; groups that stand together look at different things."""
    sizes = group_sizes(rng, count)
    site = _site(rng, kind, count)
    spots, targets = _apart(rng, site, len(sizes))
    return _stand(rng, site, np.repeat(spots, sizes, axis=0), np.repeat(targets, sizes, axis=0), _labels(sizes))


def all_in_one(rng: np.random.Generator, kind: Kind, count: int) -> Layout:
    """`count` robots that stand together and look at one thing."""
    site = _site(rng, kind, count)
    spot, target = site.draw(rng)
    ones = np.ones((count, 1))
    return _stand(rng, site, ones * spot, ones * target, np.zeros(count, np.intp))


def all_apart(rng: np.random.Generator, kind: Kind, count: int) -> Layout:
    """`count` robots that are far from one another, and see nothing of what the others see."""
    site = _site(rng, kind, count)
    spots, targets = (np.array(rows) for rows in zip(*(site.draw(rng) for _ in range(count)), strict=True))
    # Each is moved, with its target, to a place of its own; walls are moved along.
    columns = math.ceil(math.sqrt(count)) if kind in {"ground", "terrain"} else count
    shift = np.stack([np.arange(count) % columns, np.arange(count) // columns], axis=1) * _LONELY_M
    middle = spots if kind in {"ground", "terrain"} else spots * (1, 0)
    spots, targets = spots - middle + shift, targets + np.column_stack([shift - middle, np.zeros(count)])
    return _stand(rng, site, spots, targets, np.arange(count))


def group_sizes(rng: np.random.Generator, count: int) -> list[int]:
    """Sizes of groups and loners that add up to `count`."""
    loners = int(rng.binomial(count, LONER_SHARE))
    left, sizes = count - loners, [1] * loners
    while left:
        size = int(rng.integers(SIZES[0], SIZES[1] + 1))
        size = left if left <= SIZES[0] + 1 else min(size, left)
        if left - size == 1:
            size = size - 1 if size > SIZES[0] else left
        sizes.append(size)
        left -= size
    return sizes


def _labels(sizes: list[int]) -> Labels:
    return np.repeat(np.arange(len(sizes)), sizes)


def _site(rng: np.random.Generator, kind: Kind, count: int) -> _Site:
    side, length = math.sqrt(count * AREA_M2), count * STRETCH_M
    match kind:
        case "ground":
            return _Site(scenes.floor(), lambda draw: _over_ground(draw, side), (1.8, 2.6))
        case "terrain":
            hills = scenes.hills(rng, side, _HILL_RISE_M, _HILL_WIDTH_M)
            return _Site(hills, lambda draw: _over_ground(draw, side), (1.4, 2.2))
        case "wall":
            return _Site(scenes.wall(), lambda draw: _along_wall(draw, length), (0.8, 1.6))
        case "corridor":
            return _Site(scenes.corridor(CORRIDOR_M), lambda draw: _in_corridor(draw, length), (0.8, 1.6))


def _over_ground(rng: np.random.Generator, side_m: float) -> tuple[Floats, Floats]:
    spot = rng.uniform(0, side_m, 2)
    bearing, reach = rng.uniform(0, 2 * math.pi), rng.uniform(2.0, 3.2)
    x, y = spot + reach * np.array([math.cos(bearing), math.sin(bearing)])
    return spot, np.array([x, y, 0.0])


def _along_wall(rng: np.random.Generator, length_m: float) -> tuple[Floats, Floats]:
    x = rng.uniform(0, length_m)
    return np.array([x, -rng.uniform(2.5, 4.5)]), np.array([x + rng.normal(0, 1.5), 0.0, rng.uniform(0.8, 1.8)])


def _in_corridor(rng: np.random.Generator, length_m: float) -> tuple[Floats, Floats]:
    x, y = rng.uniform(0, length_m), -CORRIDOR_M / 2 + rng.uniform(-1.0, 1.0)
    face = 0.0 if rng.random() < 0.5 else -CORRIDOR_M
    return np.array([x, y]), np.array([x + rng.normal(0, 1.5), face, rng.uniform(0.8, 1.8)])


def _apart(rng: np.random.Generator, site: _Site, groups: int) -> tuple[Floats, Floats]:
    """Spots (g, 2) and targets (g, 3) of groups that are told apart by one or the other."""
    spots, targets = np.empty((0, 2)), np.empty((0, 3))
    for _ in range(groups):
        for _ in range(_DRAWS):
            spot, target = site.draw(rng)
            aside = np.square(spots - spot).sum(axis=1) / _SPOT_APART_M**2
            beyond = np.square(targets - target).sum(axis=1) / _TARGET_APART_M**2
            if (aside + beyond >= 1).all():
                break
        spots, targets = np.vstack([spots, spot]), np.vstack([targets, target])
    return spots, targets


def _stand(rng: np.random.Generator, site: _Site, spots: Floats, targets: Floats, truth: Labels) -> Layout:
    """Robots around their spots (N, 2), looking about their targets (N, 3), in no order of groups."""
    order = rng.permutation(len(spots))
    spots, targets, truth = spots[order], targets[order], truth[order]
    places = spots + rng.normal(0, _SPREAD_M, spots.shape)
    height = np.array([site.scene.height_m(x, y) for x, y in places]) + rng.uniform(*site.eye_m, len(places))
    aims = targets + rng.normal(0, _JITTER_M, targets.shape)
    aims[:, 2] += [site.scene.height_m(x, y) for x, y in aims[:, :2]]
    return Layout(site.scene, looking(np.column_stack([places, height]), aims), truth)
