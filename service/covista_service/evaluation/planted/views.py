"""Cameras of a planted swarm, and what each sees of the others' images."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from covista_service.compiled import compiled
from covista_service.evaluation.planted.scene import RANGE_M, Mask, Scene
from covista_service.perception.camera import Floats

FIELD_OF_VIEW_DEG = 65.0
# Rays per image, across and down: all share one camera of 4 : 3.
GRID = (24, 18)
# Half the image's width and height at depth 1.
HALF_WIDTH = math.tan(math.radians(FIELD_OF_VIEW_DEG) / 2)
HALF_HEIGHT = HALF_WIDTH * 3 / 4


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """Where N cameras stand, (N, 3), and `world_from_camera` (N, 3, 3): x right, y down, z ahead."""

    centres_m: Floats
    world_from_camera: Floats

    def __len__(self) -> int:
        return len(self.centres_m)


def looking(centres_m: Floats, targets_m: Floats) -> Views:
    """Upright cameras with their targets (N, 3) in the middle of their images."""
    ahead = targets_m - centres_m
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    right = np.stack([ahead[:, 1], -ahead[:, 0], np.zeros(len(ahead))], axis=1)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    return Views(centres_m, np.stack([right, np.cross(ahead, right), ahead], axis=2))


def overlap(scene: Scene, views: Views) -> Floats:
    """True overlap (N, N). Row i: of i's rays that meet a surface, the share whose surface j sees; 1 on the diagonal.

    Seen is what lies in j's image, within its range, with nothing before it. A row is 0 where i sees no surface at all.
    """
    points, met = surfaces(scene, views)
    result = _shares(points, met, views, scene)
    np.fill_diagonal(result, 1.0)
    return result


def frustum_overlap(scene: Scene, views: Views) -> Floats:
    """Overlap (N, N) as predicted from poses and each image's median depth: a plane parallel to the image.

    Nothing hides anything. 1 on the diagonal.
    """
    rays, depth, met = _seen(scene, views)
    middle = np.array([np.median(row[there]) if there.any() else 0.0 for row, there in zip(depth, met, strict=True)])
    points = views.centres_m[:, None] + middle[:, None, None] * rays
    result = _shares(points, met.any(axis=1, keepdims=True) | met, views, None)
    np.fill_diagonal(result, 1.0)
    return result


def surfaces(scene: Scene, views: Views) -> tuple[Floats, Mask]:
    """Points (N, rays, 3) that the rays of each image meet, and which rays meet one; the others stay at the eye."""
    rays, depth, met = _seen(scene, views)
    return views.centres_m[:, None] + np.where(met, depth, 0.0)[..., None] * rays, met


def _seen(scene: Scene, views: Views) -> tuple[Floats, Floats, Mask]:
    """Rays (N, rays, 3) of all images at depth 1, the depths at which they meet a surface, and whether they do."""
    rays = _rays(views)
    eyes = np.repeat(views.centres_m, rays.shape[1], axis=0)
    depth = scene.meet(eyes, rays.reshape(-1, 3)).reshape(rays.shape[:2])
    return rays, depth, np.isfinite(depth)


def _rays(views: Views) -> Floats:
    """Rays (N, rays, 3) through the middles of a grid of cells, at depth 1, in the world's frame."""
    across, down = ((np.arange(count) + 0.5) / count * 2 - 1 for count in GRID)
    x, y = np.meshgrid(across * HALF_WIDTH, down * HALF_HEIGHT)
    rays = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
    return np.ascontiguousarray(rays @ views.world_from_camera.transpose(0, 2, 1))


def _shares(points_m: Floats, met: Mask, views: Views, scene: Scene | None) -> Floats:
    """Shares (N, N) of the points (N, rays, 3) `met` that each camera sees; without a scene nothing hides any."""
    flat, valid = points_m.reshape(-1, 3), met.ravel()
    seen_by = np.empty((len(views), len(views)))
    for j in range(len(views)):
        inside = np.flatnonzero(_in_view(flat, valid, views.centres_m[j], views.world_from_camera[j]))
        if scene is not None:
            inside = inside[scene.open(flat[inside], views.centres_m[j])]
        seen_by[:, j] = np.bincount(inside // met.shape[1], minlength=len(views))
    shares: Floats = seen_by / np.maximum(met.sum(axis=1, keepdims=True), 1)
    return shares


@compiled
def _in_view(points: Floats, valid: Mask, centre: Floats, rotation: Floats) -> Mask:
    inside = np.zeros(len(points), np.bool_)
    for k in range(len(points)):
        if not valid[k]:
            continue
        dx, dy, dz = points[k, 0] - centre[0], points[k, 1] - centre[1], points[k, 2] - centre[2]
        z = dx * rotation[0, 2] + dy * rotation[1, 2] + dz * rotation[2, 2]
        if z <= 0 or dx * dx + dy * dy + dz * dz > RANGE_M * RANGE_M:
            continue
        x = dx * rotation[0, 0] + dy * rotation[1, 0] + dz * rotation[2, 0]
        y = dx * rotation[0, 1] + dy * rotation[1, 1] + dz * rotation[2, 1]
        inside[k] = abs(x) <= HALF_WIDTH * z and abs(y) <= HALF_HEIGHT * z
    return inside
