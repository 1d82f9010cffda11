"""Ray casting: what a camera's rays meet first.

Seen by a pinhole camera, a plane n.X = d has the inverse depth rho = (n^T K^-1 / d) (x, y, 1), and the place of a hit
on the plane times rho is linear in (x, y, 1) as well. So a cast is exact, and a handful of multiplications per ray.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from covista_schemas.messages import Camera, Pose
from numpy.typing import NDArray

from covista_clients.simulation.viewing import ray_from_pixel, world_from_camera
from covista_clients.simulation.world import Facets, Floats

NOTHING = -1
_NEAR_M = 0.02
# Rectangles reach this much beyond their edges, so that no ray slips through where two of them meet.
_SEAM_M = 1e-4
_WIDENED_PX = 0.5
_LEAST_DISTANCE_M = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """The facets that a camera may see, K of the world's F, nearest first, as functions of (x, y, 1) in pixels.

    `facet` (K,) their indices; `inverse_depth`, `across`, `along` (K, 3): 1/Z, and metres right and down from the
    facet's corner times 1/Z; `inside` (K, 4, 3): not negative inside the rectangle; `bounds_px` (K, 4): least x and
    y and greatest x and y of its picture, somewhat widened; `distance_m` (K,): from the camera to its plane.
    """

    facet: NDArray[np.int64]
    inverse_depth: Floats
    across: Floats
    along: Floats
    inside: Floats
    bounds_px: Floats
    distance_m: Floats


def sight(facets: Facets, camera: Camera, pose: Pose) -> Sight:
    """Take all facets into the camera's frame and keep those that face it and reach into its picture."""
    rotation = world_from_camera(pose)
    to_camera = facets.corner_m - np.asarray(pose.position_m)
    distance = -(to_camera * facets.normal).sum(axis=1)
    front = np.flatnonzero(distance > _LEAST_DISTANCE_M)
    corner, right, down = (rows[front] @ rotation for rows in (to_camera, facets.right, facets.down))
    bounds, nearest = _bounds(corner, right, down, facets.extent_m[front], camera)
    limit = (camera.width - 0.5, camera.height - 0.5)
    seen = np.flatnonzero(((bounds[:, :2] < limit) & (bounds[:, 2:] > -0.5)).all(axis=1))
    seen = seen[np.argsort(nearest[seen], kind="stable")]
    corner, right, down, front, bounds = corner[seen], right[seen], down[seen], front[seen], bounds[seen]
    rays = ray_from_pixel(camera)
    normal = facets.normal[front] @ rotation
    rho = normal @ rays / -distance[front, None]
    across = right @ rays - rho * (corner * right).sum(axis=1, keepdims=True)
    along = down @ rays - rho * (corner * down).sum(axis=1, keepdims=True)
    width, height = facets.extent_m[front, :1], facets.extent_m[front, 1:]
    edges = (
        across + _SEAM_M * rho,
        (width + _SEAM_M) * rho - across,
        along + _SEAM_M * rho,
        (height + _SEAM_M) * rho - along,
    )
    return Sight(front, rho, across, along, np.stack(edges, axis=1), bounds, distance[front])


def cast(sight: Sight, points_px: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Inverse depth (n,) of what rays through points (n, 2) meet first, 0 for nothing, and its facet or NOTHING."""
    x, y = np.ascontiguousarray(points_px.T)
    best = np.zeros(len(x))
    facet = np.full(len(x), NOTHING, np.int64)
    for k, (x_low, y_low, x_high, y_high) in enumerate(sight.bounds_px.tolist()):
        some = np.flatnonzero((x >= x_low) & (x <= x_high) & (y >= y_low) & (y <= y_high))
        ray = np.stack([x[some], y[some], np.ones(len(some))])
        rho = sight.inverse_depth[k] @ ray
        inside = (sight.inside[k] @ ray).min(axis=0, initial=np.inf) >= 0
        first = np.flatnonzero(inside & (rho > best[some]))
        best[some[first]] = rho[first]
        facet[some[first]] = sight.facet[k]
    return best, facet


def _bounds(corner: Floats, right: Floats, down: Floats, extent: Floats, camera: Camera) -> tuple[Floats, Floats]:
    """Pixel bounds (K, 4) of rectangles clipped at the near plane, inf to -inf if behind; least depths (K,)."""
    wide, tall = right * extent[:, :1], down * extent[:, 1:]
    corners = np.stack([corner, corner + wide, corner + wide + tall, corner + tall], axis=1)
    following = np.roll(corners, -1, axis=1)
    z, z_next = corners[..., 2], following[..., 2]
    crossing = (z < _NEAR_M) != (z_next < _NEAR_M)
    share = np.where(crossing, (_NEAR_M - z) / np.where(crossing, z_next - z, 1.0), 0.0)
    cut = corners + share[..., None] * (following - corners)
    points = np.concatenate([corners, cut], axis=1)
    there = np.concatenate([z >= _NEAR_M, crossing], axis=1)
    depth = np.where(there, points[..., 2], _NEAR_M)
    pixel = points[..., :2] / depth[..., None] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    low = np.where(there[..., None], pixel, np.inf).min(axis=1)
    high = np.where(there[..., None], pixel, -np.inf).max(axis=1)
    nearest = np.where(there, points[..., 2], np.inf).min(axis=1)
    return np.concatenate([low - _WIDENED_PX, high + _WIDENED_PX], axis=1), nearest
