"""Pictures to measure on: views of the arena, taken as rovers would stand."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
from covista_clients.simulation import renderer, truth, worlds
from covista_clients.simulation.world import World
from covista_schemas import features, messages
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Features, Pose, View, rotation_of

WORLD = "arena"
CAMERA = messages.Camera(fx=500, fy=500, cx=319.5, cy=239.5, width=640, height=480)
_VIEWPOINTS = 12
# Enough for some view to have four that see much of it.
_CROWD = 24
_PAIRS = 6
_LEAST_OVERLAP = 0.3


def overlapping_pairs(count: int) -> list[tuple[View, View]]:
    """Pairs of views with `count` RootSIFT features each that see at least `_LEAST_OVERLAP` of each other."""
    pairs = [(_view(a, count), _view(b, count)) for a, b in _overlapping()]
    return [pair for pair in pairs if all(len(view.features.keypoints_px) == count for view in pair)]


def company(count: int) -> list[View]:
    """A view and those that see at least `_LEAST_OVERLAP` of it, with `count` features each, and thumbnails."""
    pairs = _all_overlapping(_CROWD)
    partners = {a: [b for pair in pairs if a in pair for b in pair if b is not a] for pair in pairs for a in pair}
    best = max(partners, key=lambda pose: len(partners[pose]))
    return [replace(_view(pose, count), thumbnail=_thumbnail(pose)) for pose in (best, *partners[best])]


def views(count: int) -> list[View]:
    """A view from every viewpoint, with up to `count` RootSIFT features each."""
    return [_view(pose, count) for pose in worlds.viewpoints(_world(), _VIEWPOINTS)]


@cache
def _world() -> World:
    return worlds.build(WORLD)


def _overlapping() -> tuple[tuple[messages.Pose, messages.Pose], ...]:
    return _all_overlapping(_VIEWPOINTS)[:_PAIRS]


@cache
def _all_overlapping(viewpoints: int) -> tuple[tuple[messages.Pose, messages.Pose], ...]:
    world = _world()
    poses = worlds.viewpoints(world, viewpoints)
    return tuple(
        (a, b)
        for a, b in combinations(poses, 2)
        if min(truth.overlap(world, CAMERA, a, CAMERA, b, 8), truth.overlap(world, CAMERA, b, CAMERA, a, 8))
        >= _LEAST_OVERLAP
    )


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


@cache
def _thumbnail(pose: messages.Pose) -> NDArray[np.uint8]:
    jpeg = features.thumbnail(renderer.render(_world(), CAMERA, pose).image)
    return np.ascontiguousarray(features.decode_image(jpeg)[:, :, 0])
