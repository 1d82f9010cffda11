"""Likenesses of the paper's three scenes (Table I, Figs. 2 to 4), whose pictures were not published.

A wall with items on a shelf, the corner of a floor and a wall, and a stretch of Mars. Where the first camera stands
is stated here; the second one moves away from it along a given way until it shares as much as the paper prints.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from covista_schemas.messages import Camera, Pose

from covista_clients.simulation import truth
from covista_clients.simulation.building import Panel, Side, Solid, assemble, ground
from covista_clients.simulation.designs import standing_apart, wall
from covista_clients.simulation.textures import Material, Picture, concrete, gravel, painted, planks, rubble
from covista_clients.simulation.viewing import facing
from covista_clients.simulation.world import World

# All pixels are asked: a coarser grid is off by more than the last digit printed.
_STEP_PX = 1
_HALVINGS = 14
_AROUND: tuple[Side, ...] = ("front", "left", "right", "top", "bottom")
_AHEAD_RAD = math.pi / 2


@dataclass(frozen=True, slots=True)
class Vantage:
    """Where an upright camera stands and looks: `yaw_rad` from world x towards y, `pitch_rad` positive upwards."""

    position_m: tuple[float, float, float]
    yaw_rad: float
    pitch_rad: float

    @property
    def pose(self) -> Pose:
        """The camera's pose."""
        return facing(self.position_m, self.yaw_rad, self.pitch_rad)


@dataclass(frozen=True, slots=True, eq=False)
class PaperScene:
    """A world, the first camera in it, and the way of the second one: `shift_m` and `turn_rad` at its end."""

    world: World
    first: Vantage
    shift_m: tuple[float, float, float]
    turn_rad: float

    def second(self, way: float) -> Vantage:
        """The second camera after a share `way` of its way; at 0 it stands where the first one does."""
        x, y, z = (at + way * shift for at, shift in zip(self.first.position_m, self.shift_m, strict=True))
        return Vantage((x, y, z), self.first.yaw_rad + way * self.turn_rad, self.first.pitch_rad)


def placed(scene: PaperScene, camera: Camera, share: float) -> Vantage:
    """The second camera where it truly sees `share` of the first one's picture, by bisection along its way."""
    near, far = 0.0, 1.0
    first = scene.first.pose
    for _ in range(_HALVINGS):
        middle = (near + far) / 2
        seen = truth.overlap(scene.world, camera, first, camera, scene.second(middle).pose, _STEP_PX)
        near, far = (middle, far) if seen > share else (near, middle)
    return scene.second((near + far) / 2)


def wall_with_shelf() -> PaperScene:
    """A wall with two boards and items on them, all shallow: from where the cameras stand it is one plane."""
    rng = np.random.default_rng(1)
    front = wall((-3.4, 0.0), (7.0, 0.0), 5.6, rubble, foot_m=-1.5)
    solids = [front]
    for height in (0.75, 1.45):
        solids.append(Solid((0.0, -0.04, height), (3.6, 0.08, 0.04), planks, 0.0, _AROUND))
        x = -1.7
        while x < 1.4:
            width, thick = rng.uniform(0.16, 0.4), rng.uniform(0.03, 0.06)
            base = (x + width / 2, -thick / 2, height + 0.04)
            material = (painted, concrete, planks)[int(rng.integers(3))]
            solids.append(Solid(base, (width, thick, rng.uniform(0.22, 0.5)), material, 0.0, _AROUND))
            x += width + rng.uniform(0.03, 0.3)
    first = Vantage((-0.5, -3.2, 1.35), _AHEAD_RAD, math.radians(-3))
    return PaperScene(_built("paper wall", (), solids), first, (0.8, 0.0, 0.0), -math.radians(50))


def floor_with_wall() -> PaperScene:
    """A floor of flagstones and the panelled wall that it ends at: two planes."""
    floor = ground((-4.0, -4.5), (4.0, 0.1), rubble)
    back = wall((-4.0, 0.0), (4.0, 0.0), 2.6, planks)
    first = Vantage((-0.1, -3.0, 1.3), _AHEAD_RAD, math.radians(-22))
    return PaperScene(_built("paper floor", (floor,), (back,)), first, (1.2, 0.0, 0.0), 0.0)


def mars() -> PaperScene:
    """Level ground, strewn with pebbles, and rocks on it that are low seen from a mast."""
    rng = np.random.default_rng(2)
    regolith = tinted(gravel, (0.62, 0.82, 1.12))
    floor = ground((-6.0, -1.0), (6.0, 8.0), regolith)
    rocks: list[Solid] = []
    discs: list[tuple[float, float, float]] = []
    while len(rocks) < 26:
        x, y, radius = rng.uniform(-3.5, 3.5), rng.uniform(0.6, 6.5), 0.05 + 0.14 * rng.random() ** 2
        if standing_apart(discs, x, y, radius):
            discs.append((x, y, radius))
            size = (radius * rng.uniform(1.2, 1.9), radius * rng.uniform(0.9, 1.5), radius * rng.uniform(0.3, 0.6))
            rocks.append(Solid((x, y, 0.0), size, tinted(concrete, (0.5, 0.66, 0.92)), rng.uniform(0, math.pi)))
    first = Vantage((-0.2, 0.0, 1.2), _AHEAD_RAD, math.radians(-36))
    return PaperScene(_built("paper mars", (floor,), rocks), first, (1.6, 0.0, 0.0), 0.0)


PAPER_SCENES: Mapping[str, Callable[[], PaperScene]] = {
    "Wall": wall_with_shelf,
    "Floor": floor_with_wall,
    "Mars": mars,
}


def tinted(material: Material, bgr: tuple[float, float, float]) -> Material:
    """The same material in coloured light."""

    def coloured(rng: np.random.Generator, height_px: int, width_px: int, texels_per_m: float, tone: float) -> Picture:
        plain = material(rng, height_px, width_px, texels_per_m, tone)
        light = np.array((*bgr, 1.0))
        return np.asarray(cv2.multiply(plain, light), np.uint8)

    return coloured


def _built(name: str, panels: tuple[Panel, ...], solids: list[Solid] | tuple[Solid, ...]) -> World:
    facets, atlas = assemble(panels, solids, np.random.default_rng(0))
    return World(name, 0, facets, atlas, ())
