"""What two cameras may have in common, judged from poses and a depth alone."""

from __future__ import annotations

import numpy as np

from covista_service.perception.camera import Camera, Floats, Pose, relative
from covista_service.perception.overlap import common_field


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

    Corners (k, 3), directions (0 | 4, 3) in which it is endless, faces n . X <= d.
    """

    def __init__(self, camera: Camera, pose: Pose, near_far_m: tuple[float, float]) -> None:
        near, far = near_far_m
        right, bottom = camera.width - 0.5, camera.height - 0.5
        pixels = np.array([[-0.5, -0.5, 1], [right, -0.5, 1], [right, bottom, 1], [-0.5, bottom, 1]])
        rays = pixels @ camera.rays_from_pixels.T @ pose.world_from_camera.T
        endless = not np.isfinite(far)
        depths = [near] if endless else [near, far]
        self.corners = pose.centre_m + np.vstack([depth * rays for depth in depths])
        self.directions = rays if endless else np.zeros((0, 3))
        forward = pose.world_from_camera[:, 2]
        sides = np.cross(np.roll(rays, -1, axis=0), rays)
        at_centre = sides @ pose.centre_m
        ends = [-forward] if endless else [-forward, forward]
        limits = [-near] if endless else [-near, far]
        self.normals = np.vstack([sides, *ends])
        self.offsets = np.concatenate([at_centre, np.array(limits) + np.array(ends) @ pose.centre_m])

    def may_meet(self, other: Frustum) -> bool:
        """As `may_meet`."""
        return not (self._has_face_before(other) or other._has_face_before(self))

    def _has_face_before(self, other: Frustum) -> bool:
        """Does a face have the whole other frustum on its outer side?"""
        beyond = (other.corners @ self.normals.T > self.offsets).all(axis=0)
        parting = (other.directions @ self.normals.T >= 0).all(axis=0)
        return bool((beyond & parting).any())


def _parallel_plane(depth_m: float) -> Floats:
    return np.array([[0.0, 0.0, -1.0 / depth_m]])
