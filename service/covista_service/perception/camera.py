"""Cameras, poses and features as the maths sees them.

OpenCV camera axes (x right, y down, z forward); pixel centres at integers, an image spans
[-.5, width - .5] x [-.5, height - .5]. Lens distortion is taken out of points once; everything after works in the
*ideal* pinhole image of the same matrix and size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
DistortionModel = Literal["none", "plumb_bob", "equidistant"]


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """`matrix` (3, 3) in pixels, image size, and distortion coefficients in OpenCV's order."""

    matrix: Floats
    width: int
    height: int
    distortion: DistortionModel = "none"
    coefficients: tuple[float, ...] = ()

    @property
    def pixels(self) -> int:
        """Number of pixels, N_p of Eq. 16."""
        return self.width * self.height

    @property
    def rays_from_pixels(self) -> Floats:
        """Inverse (3, 3) of the camera matrix: `rays_from_pixels @ (x, y, 1)` is the ray with Z = 1."""
        (fx, skew, cx), (_, fy, cy), _ = self.matrix.tolist()
        slant = -skew / (fx * fy)
        return np.array([[1 / fx, slant, -cx / fx - slant * cy], [0.0, 1 / fy, -cy / fy], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Pose of a camera: X_world = world_from_camera @ X_camera + centre_m, with `world_from_camera` (3, 3)."""

    world_from_camera: Floats
    centre_m: Floats


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Features:
    """`kind` (rootsift | orb), `keypoints_px` (n, 2) float32 as detected, `descriptors` (n, 128 | 32) uint8."""

    kind: str
    keypoints_px: NDArray[np.float32]
    descriptors: NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What a survey needs of a keyframe. `thumbnail` is a small grey image (h, w) uint8, where there is one."""

    camera: Camera
    pose: Pose
    features: Features
    thumbnail: NDArray[np.uint8] | None = None


def relative(first: Pose, second: Pose) -> tuple[Floats, Floats]:
    """Rotation (3, 3) and translation (3,) that take points of the first camera's frame to the second's.

    X_2 = R X_1 + t.
    """
    second_from_world = second.world_from_camera.T
    rotation = second_from_world @ first.world_from_camera
    return rotation, second_from_world @ (first.centre_m - second.centre_m)


def relatives(poses: Sequence[Pose], pairs: NDArray[np.integer]) -> tuple[Floats, Floats]:
    """`relative` of many ordered pairs (n, 2) of poses: rotations (n, 3, 3) and translations (n, 3)."""
    world_from_camera = np.array([pose.world_from_camera for pose in poses], np.float64).reshape(-1, 3, 3)
    centres_m = np.array([pose.centre_m for pose in poses], np.float64).reshape(-1, 3)
    first, second = np.asarray(pairs, np.intp).reshape(-1, 2).T
    second_from_world = world_from_camera[second].transpose(0, 2, 1)
    translations = second_from_world @ (centres_m[first] - centres_m[second])[:, :, None]
    return second_from_world @ world_from_camera[first], translations[:, :, 0]


def rotation_of(quaternion_xyzw: tuple[float, float, float, float]) -> Floats:
    """Rotation matrix (3, 3) of a unit quaternion."""
    x, y, z, w = np.asarray(quaternion_xyzw, np.float64) / np.linalg.norm(quaternion_xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def undistort(camera: Camera, points_px: NDArray[np.floating]) -> Floats:
    """Points (n, 2) as detected -> points (n, 2) in the ideal image."""
    points = np.ascontiguousarray(points_px, np.float64).reshape(-1, 2)
    if camera.distortion == "none" or not len(points):
        return points
    coefficients = np.array(camera.coefficients, np.float64)
    solve = cv2.undistortPoints if camera.distortion == "plumb_bob" else cv2.fisheye.undistortPoints
    ideal = solve(points[:, None], camera.matrix, coefficients, P=camera.matrix)
    return np.asarray(ideal, np.float64)[:, 0]
