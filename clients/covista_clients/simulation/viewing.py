"""Cameras and poses of simulated rovers."""

from __future__ import annotations

import math

import numpy as np
from covista_schemas.messages import Camera, Pose
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_Quaternion = tuple[float, float, float, float]

FIELD_OF_VIEW_DEG = 65.0
# World from a camera that looks along world x, upright.
_ALONG_X: _Quaternion = (-0.5, 0.5, -0.5, 0.5)


def pinhole(width: int = 320, height: int = 240, field_of_view_deg: float = FIELD_OF_VIEW_DEG) -> Camera:
    """An ideal camera with square pixels, centred, of the given horizontal field of view."""
    focal_px = width / 2 / math.tan(math.radians(field_of_view_deg) / 2)
    return Camera(fx=focal_px, fy=focal_px, cx=(width - 1) / 2, cy=(height - 1) / 2, width=width, height=height)


def facing(position_m: tuple[float, float, float], yaw_rad: float, pitch_rad: float, time_ns: int = 0) -> Pose:
    """Pose of an upright camera; yaw counts from world x towards y, pitch is positive upwards."""
    turn = (0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2))
    tilt = (0.0, -math.sin(pitch_rad / 2), 0.0, math.cos(pitch_rad / 2))
    return Pose(position_m, _product(_product(turn, tilt), _ALONG_X), time_ns)


def looking_at(position_m: tuple[float, float, float], target_m: tuple[float, float, float]) -> Pose:
    """Pose of an upright camera with `target_m` in the middle of its picture."""
    dx, dy, dz = (b - a for a, b in zip(position_m, target_m, strict=True))
    return facing(position_m, math.atan2(dy, dx), math.atan2(dz, math.hypot(dx, dy)))


def world_from_camera(pose: Pose) -> Floats:
    """Rotation matrix (3, 3) of a pose."""
    x, y, z, w = np.asarray(pose.orientation_xyzw, np.float64) / math.hypot(*pose.orientation_xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def ray_from_pixel(camera: Camera) -> Floats:
    """K^-1 (3, 3): (x, y, 1) in pixels -> ray in the camera frame with z = 1. Raises ValueError for a lens."""
    if camera.distortion.model != "none":
        raise ValueError(f"simulated cameras have no lens distortion, this one is {camera.distortion.model}")
    return np.array(
        [[1 / camera.fx, 0, -camera.cx / camera.fx], [0, 1 / camera.fy, -camera.cy / camera.fy], [0, 0, 1.0]]
    )


def _product(a: _Quaternion, b: _Quaternion) -> _Quaternion:
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
