"""Warm machine code: every compiled function runs once, so that the first keyframes need not wait for a compiler."""

from __future__ import annotations

from functools import cache

import numpy as np

from covista_service.perception.camera import Camera, Features, Floats, Pose, View, relative
from covista_service.perception.flow import flow
from covista_service.perception.regions import RegionOptions, regions
from covista_service.perception.scene import SceneOptions, reconstruct
from covista_service.perception.surface import COLUMNS, ROWS
from covista_service.perception.survey import SurveyOptions, survey
from covista_service.perception.visibility import Seeing

_CAMERA = Camera(np.array([[250.0, 0, 159.5], [0, 250.0, 119.5], [0, 0, 1]]), 320, 240)
_STEP_M = 0.5
_OFF_RAD = 0.07


@cache
def warm_up() -> None:
    """Compile what no earlier process has left in numba's cache, and load the rest; once per process.

    Three views of a slanted wall go through all stages. One reports a wrong pose, or nobody would adjust poses. ORB
    takes the same ways as RootSIFT.
    """
    views = _views()
    pairs = [(0, 1), (0, 2), (1, 2)]
    scene = reconstruct(views, pairs, SceneOptions())
    for pair in pairs:
        scene.overlap(*pair)
    moved = relative(scene.poses[0], scene.poses[1])
    seen = [Seeing(_CAMERA, surface) for surface in scene.surfaces[:1] if surface is not None]
    flow(seen, moved[0][None], moved[1][None], [_CAMERA])
    regions(np.ones((ROWS, COLUMNS), np.bool_), _CAMERA, RegionOptions())
    survey(views[0], views[1], SurveyOptions())


def _views(points: int = 200) -> list[View]:
    random = np.random.default_rng(0)
    x, y = random.uniform(-2, 3, points), random.uniform(-1.5, 1.5, points)
    wall = np.column_stack((x, y, 4 + 0.2 * x))
    descriptors = random.integers(0, 90, (points, 128)).astype(np.uint8)
    # Tilted, for a turn about the upright axis would only move points along their epipolar lines.
    off = np.array([[1, 0, 0], [0, np.cos(_OFF_RAD), -np.sin(_OFF_RAD)], [0, np.sin(_OFF_RAD), np.cos(_OFF_RAD)]])
    return [_view(wall, descriptors, _STEP_M * k, off if k == 2 else np.eye(3)) for k in range(3)]


def _view(points: Floats, descriptors: np.ndarray, x_m: float, reported: Floats) -> View:
    """What a camera at (x, 0, 0) sees that looks ahead, though it reports another orientation."""
    centre = np.array([x_m, 0.0, 0.0])
    ahead = (points - centre) @ _CAMERA.matrix.T
    px = ahead[:, :2] / ahead[:, 2:]
    inside = ((px > 0) & (px < (_CAMERA.width - 1, _CAMERA.height - 1))).all(axis=1)
    features = Features("rootsift", px[inside].astype(np.float32), descriptors[inside])
    return View(_CAMERA, Pose(reported, centre), features)
