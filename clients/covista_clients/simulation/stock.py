"""Keyframes made in advance: those of a few robots that drive through a world, for a crowd to send again and again.

To render a picture and to describe its features costs some 45 ms, to send a keyframe that is ready some .1 ms.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass

import numpy as np
from covista_schemas import features
from covista_schemas.messages import Camera, Features, Pose

from covista_clients.simulation import worlds
from covista_clients.simulation.arena import ROVERS_PER_COURT
from covista_clients.simulation.paths import Paths
from covista_clients.simulation.renderer import render
from covista_clients.simulation.viewing import pinhole
from covista_clients.simulation.world import Floats, World

# Four courts of the arena.
MOST_ROBOTS = 4 * ROVERS_PER_COURT
# Poses known between a keyframe and the next one; between those they are interpolated.
_BETWEEN = 8
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class StockOptions:
    """`robots` take `steps` keyframes each, `step_s` seconds of their paths apart, with up to `features` features.

    Raises ValueError for what makes no sense.
    """

    robots: int = MOST_ROBOTS
    world: str = "arena"
    seed: int = 0
    steps: int = 12
    step_s: float = 1.0
    features: int = 500
    thumbnails: bool = False
    width: int = 320
    height: int = 240

    def __post_init__(self) -> None:
        if self.world not in worlds.WORLDS:
            raise ValueError(f"there is no world {self.world!r}, but {', '.join(worlds.WORLDS)}")
        if not 1 <= self.robots <= MOST_ROBOTS:
            raise ValueError(f"a stock is of 1 to {MOST_ROBOTS} robots, not {self.robots}")
        if min(self.steps, self.features) < 1 or not (self.step_s > 0 and math.isfinite(self.step_s)):
            raise ValueError("steps, features and step_s must be positive")


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """What a keyframe shows."""

    features: Features
    thumbnail: bytes | None


@dataclass(frozen=True, slots=True, eq=False)
class Stock:
    """What robots saw: `shots` by robot and step. Robots of one court follow each other.

    The world takes the ground from `lower_m` (2,) to `upper_m` (2,). `tracks` are the robots' camera poses, `_BETWEEN`
    a step: positions, m, and orientations, x y z w, each with the sign that is closest to the one before.
    """

    options: StockOptions
    camera: Camera
    lower_m: Floats
    upper_m: Floats
    tracks: tuple[tuple[tuple[Vector, Quaternion], ...], ...]
    shots: tuple[tuple[Shot, ...], ...]

    @property
    def robots(self) -> int:
        """How many robots it is of."""
        return len(self.shots)

    @property
    def steps(self) -> int:
        """How many keyframes there are of each."""
        return len(self.shots[0])

    def placed(self, robot: int, step: float) -> tuple[Vector, Quaternion]:
        """Position and orientation of a camera at a step, which may lie between two keyframes.

        In plain numbers: for vectors of three, arrays cost ten times as much.
        """
        track = self.tracks[robot]
        whole = int(step * _BETWEEN)
        share = step * _BETWEEN - whole
        if not share or whole + 1 >= len(track):
            return track[min(whole, len(track) - 1)]
        (x, y, z), turned = track[whole]
        (next_x, next_y, next_z), next_turned = track[whole + 1]
        left = 1 - share
        a, b, c, d = (left * one + share * other for one, other in zip(turned, next_turned, strict=True))
        length = math.sqrt(a * a + b * b + c * c + d * d)
        position = (left * x + share * next_x, left * y + share * next_y, left * z + share * next_z)
        return position, (a / length, b / length, c / length, d / length)


def make(
    options: StockOptions, stop: threading.Event | None = None, on_shot: Callable[[int, int], None] | None = None
) -> Stock | None:
    """Drive, render and describe, on all cores; None once `stop` is set. `on_shot` hears how many of how many are made.

    In threads: OpenCV, which most of the time goes to, works without Python's lock, and so they need not build the
    world again as processes would.
    """
    world = worlds.build(options.world, options.seed, options.robots)
    camera = pinhole(options.width, options.height)
    tracks = list(_tracks(world, options))
    views = [pose for track in tracks for pose in track[::_BETWEEN]]
    shots: list[Shot] = []
    with closing(_taken(world, camera, views, options)) as taken:
        for shot in taken:
            if stop is not None and stop.is_set():
                return None
            shots.append(shot)
            if on_shot is not None:
                on_shot(len(shots), len(views))
    corners = _corners(world)
    return Stock(
        options,
        camera,
        corners.min(axis=0),
        corners.max(axis=0),
        tuple(tuple(_steady(track)) for track in tracks),
        tuple(tuple(shots[k : k + options.steps]) for k in range(0, len(shots), options.steps)),
    )


def _tracks(world: World, options: StockOptions) -> Iterator[list[Pose]]:
    """The poses of every robot, court by court."""
    paths, courts = Paths(world, options.robots, options.seed), len(world.courts)
    moments = [k * options.step_s / _BETWEEN for k in range((options.steps - 1) * _BETWEEN + 1)]
    for robot in sorted(range(options.robots), key=lambda robot: (robot % courts, robot)):
        yield [paths.pose(robot, moment_s) for moment_s in moments]


def _taken(world: World, camera: Camera, views: Sequence[Pose], options: StockOptions) -> Generator[Shot, None, None]:
    def take(pose: Pose) -> Shot:
        image = render(world, camera, pose).image
        thumbnail = features.thumbnail(image) if options.thumbnails else None
        return Shot(features.extract(image, count=options.features), thumbnail)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0)), "stock") as pool:
        try:
            yield from pool.map(take, views)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _corners(world: World) -> Floats:
    """Corners (n, 2) of all facets, seen from above."""
    facets = world.facets
    across, along = facets.right * facets.extent_m[:, :1], facets.down * facets.extent_m[:, 1:]
    ends = (facets.corner_m, facets.corner_m + across, facets.corner_m + along, facets.corner_m + across + along)
    return np.concatenate(ends)[:, :2]


def _steady(track: Sequence[Pose]) -> Iterator[tuple[Vector, Quaternion]]:
    before = track[0].orientation_xyzw
    for pose in track:
        x, y, z, w = pose.orientation_xyzw
        turned = sum(one * other for one, other in zip(before, (x, y, z, w), strict=True))
        before = (x, y, z, w) if turned >= 0 else (-x, -y, -z, -w)
        yield pose.position_m, before
