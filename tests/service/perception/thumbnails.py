"""Walls with texture, and what cameras see of them: thumbnails, exact depth, and points where a feature might be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from covista_service.perception.agreement import DepthPoints
from covista_service.perception.camera import Camera, Features, Floats, Pose, View
from covista_service.perception.scene import Scene, SceneOptions, Settled
from covista_service.perception.surface import COLUMNS, ROWS, cell_centres, interpolate
from numpy.typing import NDArray

from tests.service.perception.scenes import CAMERA

NO_FEATURES = Features("rootsift", np.zeros((0, 2), np.float32), np.zeros((0, 128), np.uint8))
SHAPE = (72, 96)
_FINER = 4
_TEXEL_M = 0.08


@dataclass(frozen=True)
class Wall:
    """Z = `distance_m` + `slope` X, for X between `left` and `right`."""

    distance_m: float
    slope: float = 0.0
    left: float = -50.0
    right: float = 50.0


SLANTED = (Wall(6.0, 0.3),)
STEP = (Wall(8.0), Wall(4.0, left=-1.0, right=1.0))


def inverse_depth(walls: Sequence[Wall], pose: Pose, px: Floats, camera: Camera = CAMERA) -> tuple[Floats, Floats]:
    """Inverse depth (n,) along the optical axis of the first wall at pixels (n, 2), and the points (n, 3) there."""
    rays = np.column_stack((px, np.ones(len(px)))) @ camera.rays_from_pixels.T @ pose.world_from_camera.T
    best, points = np.zeros(len(px)), np.full((len(px), 3), np.nan)
    for wall in walls:
        x, _, z = pose.centre_m
        depth = (wall.distance_m + wall.slope * x - z) / (rays[:, 2] - wall.slope * rays[:, 0])
        hit = pose.centre_m + depth[:, None] * rays
        nearer = (depth > 0) & (hit[:, 0] > wall.left) & (hit[:, 0] < wall.right) & (1 / depth > best)
        best[nearer], points[nearer] = 1 / depth[nearer], hit[nearer]
    return best, points


def thumbnail(walls: Sequence[Wall], pose: Pose, shape: tuple[int, int] = SHAPE) -> NDArray[np.uint8]:
    """The small grey image (h, w)."""
    fine = (shape[0] * _FINER, shape[1] * _FINER)
    _, points = inverse_depth(walls, pose, _centres(fine))
    noise = np.random.default_rng(5).normal(size=(512, 512)).astype(np.float32)
    texture = 128 + 150 * cv2.GaussianBlur(noise, (0, 0), 1.0)
    # Every depth has a texture of its own, and none of it is alike up and down.
    across = ((points[:, 0] + 3 * points[:, 2]) / _TEXEL_M + 200) % 511
    down = (points[:, 1] / _TEXEL_M + 256) % 511
    grey = cv2.remap(
        texture, across.reshape(fine).astype(np.float32), down.reshape(fine).astype(np.float32), cv2.INTER_LINEAR
    )
    small = cv2.resize(grey, shape[::-1], interpolation=cv2.INTER_AREA)
    return np.rint(small).clip(0, 255).astype(np.uint8)


def truth(walls: Sequence[Wall], pose: Pose) -> Floats:
    """Inverse depth (ROWS, COLUMNS) at the cells' centres."""
    return inverse_depth(walls, pose, cell_centres(CAMERA))[0].reshape(ROWS, COLUMNS)


def scene(
    walls: Sequence[Wall], poses: Sequence[Pose], points: int = 60, thumbnails: Sequence[NDArray | None] | None = None
) -> Scene:
    """Keyframes with some agreed points, the surfaces that those give, and thumbnails."""
    random = np.random.default_rng(2)
    given = [thumbnail(walls, pose) for pose in poses] if thumbnails is None else thumbnails
    views = [View(CAMERA, pose, NO_FEATURES, small) for pose, small in zip(poses, given, strict=True)]
    agreed = [_agreed(walls, pose, random.uniform((0, 0), (639, 479), (points, 2))) for pose in poses]
    surfaces = [interpolate(one, CAMERA, SceneOptions().surface) if points else None for one in agreed]
    settled = [Settled(*one) for one in zip(poses, surfaces, agreed, strict=True)]
    return Scene(tuple(views), tuple(settled), {}, np.zeros(len(poses), np.int64), np.zeros(len(poses)), SceneOptions())


def _agreed(walls: Sequence[Wall], pose: Pose, px: Floats) -> DepthPoints:
    rho, _ = inverse_depth(walls, pose, px)
    return DepthPoints(px, rho, np.full(len(px), 1e-3), np.ones(len(px)))


def _centres(shape: tuple[int, int]) -> Floats:
    height, width = shape
    x, y = (np.arange(width) + 0.5) * 640 / width - 0.5, (np.arange(height) + 0.5) * 480 / height - 0.5
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
