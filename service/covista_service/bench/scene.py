"""Pictures to measure on: views of the arena, taken as rovers would stand."""

from __future__ import annotations

from functools import cache
from itertools import combinations

import numpy as np
from covista_clients.simulation import renderer, truth, worlds
from covista_clients.simulation.world import World
from covista_schemas import features, messages

from covista_service.perception.camera import Camera, Features, Pose, View, rotation_of

WORLD = "arena"
CAMERA = messages.Camera(fx=500, fy=500, cx=319.5, cy=239.5, width=640, height=480)
_VIEWPOINTS = 12
_PAIRS = 6
_LEAST_OVERLAP = 0.3


def overlapping_pairs(count: int) -> list[tuple[View, View]]:
    """Pairs of views with `count` RootSIFT features each that see at least `_LEAST_OVERLAP` of each other."""
    pairs = [(_view(a, count), _view(b, count)) for a, b in _overlapping()]
    return [pair for pair in pairs if all(len(view.features.keypoints_px) == count for view in pair)]


@cache
def _world() -> World:
    return worlds.build(WORLD)


@cache
def _overlapping() -> tuple[tuple[messages.Pose, messages.Pose], ...]:
    world = _world()
    poses = worlds.viewpoints(world, _VIEWPOINTS)
    found = [
        (a, b)
        for a, b in combinations(poses, 2)
        if min(truth.overlap(world, CAMERA, a, CAMERA, b, 8), truth.overlap(world, CAMERA, b, CAMERA, a, 8))
        >= _LEAST_OVERLAP
    ]
    return tuple(found[:_PAIRS])


@cache
def _view(pose: messages.Pose, count: int) -> View:
    image = renderer.render(_world(), CAMERA, pose).image
    found = features.extract(image, count=count)
    matrix = np.array([[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1.0]])
    return View(
        Camera(matrix, CAMERA.width, CAMERA.height),
        Pose(rotation_of(pose.orientation_xyzw), np.array(pose.position_m)),
        Features(str(found.kind), found.keypoints_px, found.descriptors),
    )
