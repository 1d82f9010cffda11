"""What two cameras may have in common, judged from poses and a depth alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats, Pose, relative
from covista_service.perception.overlap import common_field

# No side of a frustum is farther from its axis.
_MOST_RAD = np.radians(85)


def overlap(
    first: Camera, first_pose: Pose, first_depth_m: float, second: Camera, second_pose: Pose, second_depth_m: float
) -> tuple[float, float]:
    """q_1 and q_2 if each image showed a plane parallel to it, at its depth: exact areas of polygons."""
    rotation, translation = relative(first_pose, second_pose)
    forth = common_field(first, second, rotation, translation, _parallel_plane(first_depth_m))
    back = common_field(second, first, rotation.T, -rotation.T @ translation, _parallel_plane(second_depth_m))
    return forth.overlap_first, back.overlap_first


def may_meet(
    first: Camera,
    first_pose: Pose,
    first_near_far_m: tuple[float, float],
    second: Camera,
    second_pose: Pose,
    second_near_far_m: tuple[float, float],
) -> bool:
    """False only if no point can lie in both view frusta, each between its near and far depth; far may be infinite.

    Looks for a face of one frustum with the whole other frustum beyond it, so in rare cases it says yes to two that
    just miss each other.
    """
    return Frustum(first, first_pose, first_near_far_m).may_meet(Frustum(second, second_pose, second_near_far_m))


class Frustum:
    """A view frustum in the world, built once and held against many others.

    Corners (8, 3), directions (4, 3) in which it is endless, zero if it is not, and faces n . X <= d (6 of them), n of
    length 1. With a `doubt` it is wide enough for every pose that is off by no more than the doubt's angle, and what
    is within `margin_m` of it belongs to it.
    """

    def __init__(
        self,
        camera: Camera,
        pose: Pose,
        near_far_m: tuple[float, float],
        doubt_rad: float = 0.0,
        margin_m: float = 0.0,
    ) -> None:
        """Raise nothing: an angle that would open the view to all sides opens it to almost half of the world."""
        rays, (near, far) = _rays(camera), near_far_m
        if doubt_rad > 0:
            near, far = _deepened(near, far, rays, doubt_rad)
            rays = _widened(rays, doubt_rad)
        rays = rays @ pose.world_from_camera.T
        endless = not np.isfinite(far)
        self.margin_m = margin_m
        self.corners = pose.centre_m + np.vstack([depth * rays for depth in (near, near if endless else far)])
        self.directions = rays if endless else np.zeros((4, 3))
        forward = pose.world_from_camera[:, 2]
        sides = np.cross(np.roll(rays, -1, axis=0), rays)
        sides /= np.linalg.norm(sides, axis=1, keepdims=True)
        at_centre = sides @ pose.centre_m
        ends = np.array([-forward, forward])
        # Nothing lies beyond the far face of an endless one.
        self.normals = np.vstack([sides, ends])
        self.offsets = np.concatenate([at_centre, np.array([-near, far]) + ends @ pose.centre_m])

    def may_meet(self, other: Frustum) -> bool:
        """As `may_meet`."""
        return bool(Frusta([other]).may_meet(self)[0])


class Frusta:
    """Many view frusta, each held against one other at once."""

    def __init__(self, frusta: Sequence[Frustum]) -> None:
        """Stack n frusta."""
        self._corners = np.array([one.corners for one in frusta]).reshape(-1, 8, 3)
        self._directions = np.array([one.directions for one in frusta]).reshape(-1, 4, 3)
        self._normals = np.array([one.normals for one in frusta]).reshape(-1, 6, 3)
        self._offsets = np.array([one.offsets for one in frusta]).reshape(-1, 6)
        self._margins_m = np.array([one.margin_m for one in frusta]).reshape(-1, 1)

    def may_meet(self, other: Frustum) -> NDArray[np.bool_]:
        """Which of them (n,) may meet it, as `may_meet`."""
        # Does a face of theirs have the whole other frustum on its outer side, or a face of its theirs?
        faces, apart_m = self._normals.transpose(0, 2, 1), self._margins_m + other.margin_m
        theirs = (other.corners @ faces > (self._offsets + apart_m)[:, None]).all(axis=1)
        theirs &= (other.directions @ faces >= 0).all(axis=1)
        its = (self._corners @ other.normals.T > other.offsets + apart_m[:, :, None]).all(axis=1)
        its &= (self._directions @ other.normals.T >= 0).all(axis=1)
        return np.asarray(~(theirs.any(axis=1) | its.any(axis=1)), np.bool_)


def _rays(camera: Camera) -> Floats:
    """Through the corners of the image (4, 3), with Z = 1, in the camera's frame."""
    right, bottom = camera.width - 0.5, camera.height - 0.5
    pixels = np.array([[-0.5, -0.5, 1], [right, -0.5, 1], [right, bottom, 1], [-0.5, bottom, 1]])
    return pixels @ camera.rays_from_pixels.T


def _widened(rays: Floats, angle_rad: float) -> Floats:
    """Rays (4, 3) around all that the corners' can be turned to by an angle.

    A ray's angle to a side of the image changes by up to the angle over the cosine of that to the other: the length of
    a ray with Z = 1 is more than its inverse.
    """
    length = np.linalg.norm(rays, axis=1).max()
    outward = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    angles = np.arctan(rays[:, :2]) + outward * (angle_rad * length)
    return np.column_stack((np.tan(np.clip(angles, -_MOST_RAD, _MOST_RAD)), np.ones(4)))


def _deepened(near: float, far: float, rays: Floats, angle_rad: float) -> tuple[float, float]:
    """Depths between near and far as seen along an axis that is off by an angle: cos(a + b) = cos a cos b - ..."""
    slope = float(np.linalg.norm(rays[:, :2], axis=1).max())
    cosine, sine = np.cos(angle_rad), slope * np.sin(angle_rad)
    return max(0.0, near * (cosine - sine)), far * (1 + sine)


def _parallel_plane(depth_m: float) -> Floats:
    return np.array([[0.0, 0.0, -1.0 / depth_m]])
