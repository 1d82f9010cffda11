"""Several cameras before the same points, each point with a descriptor of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from covista_service.perception.camera import Camera, Features, Floats, Pose, View

from tests.service.perception.scenes import CAMERA, project, turn


def points_on_wall(count: int = 400, distance_m: float = 6.0, slope: float = 0.2, seed: int = 0) -> Floats:
    """Points (n, 3) of a wall Z = distance + slope X, wider than any one camera sees."""
    random = np.random.default_rng(seed)
    x, y = random.uniform(-7, 7, count), random.uniform(-4, 4, count)
    return np.column_stack((x, y, distance_m + slope * x))


def side_by_side(count: int, step_m: float = 1.0) -> list[Pose]:
    """Cameras in a row, each turned a little."""
    return [Pose(turn(0, 0.03 * (k - 1), 0), np.array([step_m * k, 0.05 * k, 0.0])) for k in range(count)]


def views(points: Floats, poses: Sequence[Pose], noise_px: float = 0.0, camera: Camera = CAMERA) -> list[View]:
    """What each camera sees of the points."""
    random = np.random.default_rng(1)
    raw = np.abs(random.normal(size=(len(points), 128)))
    descriptors = np.rint(512 * raw / np.linalg.norm(raw, axis=1, keepdims=True)).clip(0, 255).astype(np.uint8)
    return [_view(points, descriptors, pose, noise_px, camera, random) for pose in poses]


def moved(view: View, pose: Pose) -> View:
    """The same keyframe, reported from elsewhere."""
    return View(view.camera, pose, view.features)


def _view(
    points: Floats, descriptors: np.ndarray, pose: Pose, noise_px: float, camera: Camera, random: np.random.Generator
) -> View:
    ahead = (points - pose.centre_m) @ pose.world_from_camera[:, 2] > 0.1
    px = project(camera, pose, points) + random.normal(0, noise_px, (len(points), 2))
    inside = ahead & (px > 0).all(axis=1) & (px[:, 0] < camera.width - 1) & (px[:, 1] < camera.height - 1)
    return View(camera, pose, Features("rootsift", px[inside].astype(np.float32), descriptors[inside]))
