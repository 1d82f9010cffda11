"""The true overlap of two views: what part of the one picture the other camera sees, occlusion included."""

from __future__ import annotations

import numpy as np
from covista_schemas.messages import Camera, Pose
from numpy.typing import NDArray

from covista_clients.simulation.sight import NOTHING, cast, sight
from covista_clients.simulation.viewing import ray_from_pixel, world_from_camera
from covista_clients.simulation.world import Floats, World

STEP_PX = 4
# Rounding of the way there and back; a surface this much nearer, as a share of its depth, hides a point.
_TOLERANCE = 1e-6


def overlap(world: World, camera_a: Camera, pose_a: Pose, camera_b: Camera, pose_b: Pose, step: int = STEP_PX) -> float:
    """Share of a's pixels that see a surface whose surface b sees too: in front, in its picture, nothing between.

    Every `step`-th pixel in both directions is asked. 0 where a sees no surface at all.
    """
    met, seen = common(world, camera_a, pose_a, camera_b, pose_b, step)
    return float(np.count_nonzero(seen) / np.count_nonzero(met)) if met.any() else 0.0


def common(
    world: World, camera_a: Camera, pose_a: Pose, camera_b: Camera, pose_b: Pose, step: int = STEP_PX
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which of a's `pixels` (n,) see a surface, and which of them see one that b sees too."""
    points = pixels(camera_a, step)
    inverse_depth, facet = cast(sight(world.facets, camera_a, pose_a), points)
    met = facet != NOTHING
    surface_m = lifted(camera_a, pose_a, points[met], inverse_depth[met])
    seen = np.zeros(len(points), bool)
    seen[met] = _sees(world, camera_b, pose_b, surface_m, facet[met])
    return met, seen


def pixels(camera: Camera, step: int) -> Floats:
    """The grid (n, 2) of pixels asked, row by row."""
    y, x = np.mgrid[step // 2 : camera.height : step, step // 2 : camera.width : step]
    return np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float64)


def lifted(camera: Camera, pose: Pose, points_px: Floats, inverse_depth: Floats) -> Floats:
    """World points (n, 3) of pixels (n, 2) at an inverse depth (n,)."""
    rays = np.column_stack([points_px, np.ones(len(points_px))]) @ ray_from_pixel(camera).T
    surface_m: Floats = rays / inverse_depth[:, None] @ world_from_camera(pose).T + np.asarray(pose.position_m)
    return surface_m


def _sees(world: World, camera: Camera, pose: Pose, surface_m: Floats, facet: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether the camera sees points (n, 3) that lie on facets (n,)."""
    view = sight(world.facets, camera, pose)
    facing = np.zeros(len(world.facets), bool)
    facing[view.facet] = True
    x, y, depth = ((surface_m - np.asarray(pose.position_m)) @ world_from_camera(pose)).T
    ahead = facing[facet] & (depth > 0)
    depth = np.where(ahead, depth, 1.0)
    column, row = camera.fx * x / depth + camera.cx, camera.fy * y / depth + camera.cy
    inside = ahead & (np.abs(column - (camera.width - 1) / 2) <= camera.width / 2)
    inside &= np.abs(row - (camera.height - 1) / 2) <= camera.height / 2
    seen = np.flatnonzero(inside)
    first, _ = cast(view, np.stack([column[seen], row[seen]], axis=1))
    answer = np.zeros(len(surface_m), bool)
    answer[seen] = first <= (1 + _TOLERANCE) / depth[seen]
    return answer
