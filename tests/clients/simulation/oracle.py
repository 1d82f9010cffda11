"""Ray casting as the textbook has it: one ray and one rectangle after the other, in the world frame.

Rectangles stop rays from both sides here. Solids are closed and cameras stand outside, so that changes nothing.
"""

from __future__ import annotations

import numpy as np
from covista_clients.simulation.world import World
from covista_schemas.messages import Camera, Pose
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def turned(pose: Pose, vectors: Floats) -> Floats:
    """Vectors (n, 3) of the camera frame in the world frame: v + 2 w (q x v) + 2 q x (q x v)."""
    q, w = np.array(pose.orientation_xyzw[:3]), pose.orientation_xyzw[3]
    once = np.cross(q, vectors)
    return vectors + 2 * w * once + 2 * np.cross(q, once)


def rays(camera: Camera, pose: Pose, points_px: Floats) -> Floats:
    """Directions (n, 3) in the world frame, of depth 1."""
    x, y = points_px.T
    local = np.stack([(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, np.ones_like(x)], axis=1)
    return turned(pose, local)


def first_hit(world: World, origin: Floats, directions: Floats) -> Floats:
    """Least positive multiple (n,) of each direction that ends on a rectangle; inf if none."""
    least = np.full(len(directions), np.inf)
    facets = world.facets
    for corner, right, down, extent in zip(facets.corner_m, facets.right, facets.down, facets.extent_m, strict=True):
        normal = np.cross(right, down)
        slope = directions @ normal
        safe = np.where(np.abs(slope) < 1e-12, np.nan, slope)
        reach = ((corner - origin) @ normal) / safe
        hit = origin + reach[:, None] * directions - corner
        s, t = hit @ right, hit @ down
        on_it = (s >= -1e-5) & (s <= extent[0] + 1e-5) & (t >= -1e-5) & (t <= extent[1] + 1e-5) & (reach > 1e-9)
        least = np.where(on_it & (reach < least), reach, least)
    return least


def overlap(world: World, camera_a: Camera, a: Pose, camera_b: Camera, b: Pose, step: int) -> float:
    """Share of a's pixels with a surface that b sees: followed back from b as a ray of its own."""
    ys, xs = np.mgrid[step // 2 : camera_a.height : step, step // 2 : camera_a.width : step]
    points = np.stack([xs.ravel(), ys.ravel()], axis=1).astype(float)
    directions = rays(camera_a, a, points)
    depth = first_hit(world, np.array(a.position_m), directions)
    met = np.isfinite(depth)
    surface = np.array(a.position_m) + depth[met, None] * directions[met]
    way = surface - np.array(b.position_m)
    axes = turned(b, np.eye(3))
    x, y, z = (way @ axes.T).T
    ahead = z > 1e-9
    safe = np.where(ahead, z, 1)
    column, row = camera_b.fx * x / safe + camera_b.cx, camera_b.fy * y / safe + camera_b.cy
    inside = ahead & (column >= -0.5) & (column <= camera_b.width - 0.5)
    inside &= (row >= -0.5) & (row <= camera_b.height - 0.5)
    unhidden = first_hit(world, np.array(b.position_m), way) >= 1 - 1e-5
    return float((inside & unhidden).sum() / met.sum())
