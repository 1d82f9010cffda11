"""Where the cameras of the paper's grouping scenarios stand: the paper draws them, and prints no position.

Overlaps are exact: every ray is cast. The halls have no texture, for nobody renders them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from covista_clients.simulation import truth
from covista_clients.simulation.atlas import Atlas
from covista_clients.simulation.paper_scenes import Vantage
from covista_clients.simulation.viewing import pinhole, ray_from_pixel, world_from_camera
from covista_clients.simulation.world import Facets, World
from covista_schemas.messages import Camera

from covista_service.evaluation.paper.grouped import Seen
from covista_service.perception import polygon
from covista_service.perception.camera import Floats

HALL_M = (14.0, 10.0, 4.0)
HALL_CAMERA = pinhole(320, 240, 60.0)
PLAIN_LOWER_M, PLAIN_UPPER_M = (-12.0, -8.0), (47.0, 22.0)
# Fig. 8: what a camera sees from 10 m above is 9.28 x 6.96 m.
ABOVE_M = 10.0
ABOVE_CAMERA = pinhole(320, 240, 2 * math.degrees(math.atan(0.464)))
STEP_PX = 2
# x, y, z in metres, yaw in degrees. Found by search, such that the printed groups come out at every printed alpha and
# up to .045 beyond, that no two cameras are nearer than 1.2 m, and that overlap inside the groups grows with alpha.
SCENARIO_1 = (
    (1.9, 6.0, 1.5, 313.0),
    (3.3, 4.2, 1.0, 16.0),
    (7.8, 2.4, 1.5, 10.0),
    (12.5, 4.4, 0.6, 147.0),
    (8.5, 3.6, 1.3, 183.0),
)
SCENARIO_2 = (
    (0.8, 3.1, 1.0, 278.0),
    (3.0, 1.8, 1.0, 10.0),
    (0.9, 4.6, 1.0, 29.0),
    (10.0, 4.7, 1.0, 43.0),
    (8.8, 7.1, 1.0, 108.0),
    (5.9, 4.9, 1.0, 220.0),
    (4.2, 2.4, 1.0, 310.0),
    (12.6, 9.1, 1.0, 259.0),
    (4.0, 8.8, 1.0, 353.0),
    (7.4, 5.8, 1.0, 315.0),
)
# x, y in metres of the cameras that stay, and x of the one that moves.
RED = ((1.0, 0.4), (-5.4, 1.4))
BLUE = ((40.1, 2.3), (36.2, 2.8), (37.2, -2.1))
GREEN = ((32.9, 15.0), (30.2, 13.5), (30.3, 16.4))
MOVER_X_M = (0.7, 7.2, 13.7, 20.2, 26.7, 33.2)
MOVER_Y_M = 2.1


@dataclass(frozen=True, slots=True, eq=False)
class Scenario:
    """Cameras of one kind in a world, which from above is a rectangle between `lower_m` and `upper_m`."""

    name: str
    world: World
    camera: Camera
    vantages: tuple[Vantage, ...]
    lower_m: tuple[float, float]
    upper_m: tuple[float, float]

    @property
    def position_m(self) -> Floats:
        """Where the cameras are, (N, 3)."""
        return np.array([vantage.position_m for vantage in self.vantages])

    @property
    def outline_m(self) -> Floats:
        """Corners (4, 2) of the world from above."""
        (x0, y0), (x1, y1) = self.lower_m, self.upper_m
        return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])

    @property
    def views_m(self) -> tuple[Floats, ...]:
        """What each camera looks at from above, polygons (k, 2)."""
        return tuple(_view(self, vantage) for vantage in self.vantages)


def hall(name: str, stands: Sequence[tuple[float, float, float, float]]) -> Scenario:
    """Level cameras in the hall: x, y, z in metres, and yaw in degrees from x towards y."""
    vantages = tuple(Vantage((x, y, z), math.radians(yaw), 0.0) for x, y, z, yaw in stands)
    return Scenario(name, _hall(), HALL_CAMERA, vantages, (0.0, 0.0), HALL_M[:2])


def plain(name: str, places_m: Sequence[tuple[float, float]]) -> Scenario:
    """Cameras that look straight down on a plain, the top of their pictures towards y."""
    vantages = tuple(Vantage((x, y, ABOVE_M), math.pi / 2, -math.pi / 2) for x, y in places_m)
    return Scenario(name, _plain(), ABOVE_CAMERA, vantages, PLAIN_LOWER_M, PLAIN_UPPER_M)


def scattered(name: str, count: int, seed: int) -> Scenario:
    """Level cameras at a height of 1 m anywhere in the hall, looking anywhere."""
    rng = np.random.default_rng(seed)
    x, y, yaw = rng.uniform((0.7, 0.7, 0.0), (HALL_M[0] - 0.7, HALL_M[1] - 0.7, 360.0), (count, 3)).T
    return hall(name, [(a, b, 1.0, c) for a, b, c in zip(x.tolist(), y.tolist(), yaw.tolist(), strict=True)])


@cache
def seen(scenario: Scenario, step_px: int = STEP_PX) -> Seen:
    """Overlaps and distances; every `step_px`-th pixel of every picture is asked, in both directions."""
    count = len(scenario.vantages)
    overlap = np.eye(count)
    world, camera, poses = scenario.world, scenario.camera, [vantage.pose for vantage in scenario.vantages]
    for i in range(count):
        for j in range(count):
            if i != j:
                overlap[i, j] = truth.overlap(world, camera, poses[i], camera, poses[j], step_px)
    position_m = scenario.position_m
    return Seen(overlap, np.linalg.norm(position_m[:, None] - position_m, axis=2))


def rim_px(camera: Camera) -> Floats:
    """Corners (4, 3) of an image as (x, y, 1), clockwise from the top left."""
    right, bottom = camera.width - 0.5, camera.height - 0.5
    return np.array([(-0.5, -0.5, 1.0), (right, -0.5, 1.0), (right, bottom, 1.0), (-0.5, bottom, 1.0)])


def _view(scenario: Scenario, vantage: Vantage) -> Floats:
    """The outline of the world from above, cut to what lies in the camera's picture.

    A level camera is taken to look at all that is ahead between its left and its right, one that looks down at what
    is in its picture.
    """
    camera, rotation = scenario.camera, world_from_camera(vantage.pose)
    rays = rim_px(camera) @ (rotation @ ray_from_pixel(camera)).T
    here = np.array(vantage.position_m)
    if vantage.pitch_rad < -math.pi / 4:
        return np.asarray((here + rays * (-here[2] / rays[:, 2:]))[:, :2], np.float64)
    (lx, ly), (rx, ry) = rays[0, :2].tolist(), rays[1, :2].tolist()
    x, y = here[:2].tolist()
    sides = ((ly, -lx, lx * y - ly * x), (-ry, rx, ry * x - rx * y))
    return polygon.corners(polygon.cut([(a, b) for a, b in scenario.outline_m.tolist()], sides))


@cache
def _plain() -> World:
    (x0, y0), (x1, y1) = PLAIN_LOWER_M, PLAIN_UPPER_M
    return _bare("plain", [((x0, y1, 0), (x1 - x0, 0, 0), (0, y0 - y1, 0))])


@cache
def _hall() -> World:
    """Floor, ceiling and four walls, seen from inside."""
    x, y, z = HALL_M
    return _bare(
        "hall",
        [
            ((0, y, 0), (x, 0, 0), (0, -y, 0)),
            ((0, 0, z), (x, 0, 0), (0, y, 0)),
            ((0, y, z), (x, 0, 0), (0, 0, -z)),
            ((x, y, z), (0, -y, 0), (0, 0, -z)),
            ((x, 0, z), (-x, 0, 0), (0, 0, -z)),
            ((0, 0, z), (0, y, 0), (0, 0, -z)),
        ],
    )


_Point = tuple[float, float, float]


def _bare(name: str, rectangles: Sequence[tuple[_Point, _Point, _Point]]) -> World:
    """A world of rectangles without a texture: top left corner, and the ways from it to the right and down."""
    corner, right, down = np.moveaxis(np.array(rectangles, np.float64), 1, 0)
    wide, tall = (np.linalg.norm(way, axis=1, keepdims=True) for way in (right, down))
    right, down = right / wide, down / tall
    facets = Facets(corner, right, down, np.cross(down, right), np.hstack([wide, tall]))
    blank = Atlas(
        np.zeros((0, 0, 3), np.uint8), 1.0, np.zeros((len(corner), 2), np.float32), np.zeros((0, 2), np.float32)
    )
    return World(name, 0, facets, blank, ())
