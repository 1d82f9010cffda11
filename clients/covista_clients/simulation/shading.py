"""Colours of rendered pixels: textures filtered along the way their facet recedes, and the sky."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from covista_schemas.messages import Camera, Pose
from numpy.typing import NDArray

from covista_clients.simulation.atlas import LEVELS, Atlas
from covista_clients.simulation.sight import NOTHING, Sight
from covista_clients.simulation.viewing import ray_from_pixel, world_from_camera
from covista_clients.simulation.world import World

Singles = NDArray[np.float32]

# Samples per pixel, spread over it along the gradient of inverse depth, where its footprint is longest. Each pair
# rounds its mip level in its own way, which blends one level into the next.
_PROBES = ((-0.375, 0.125), (-0.125, 0.375))
_ROUNDING = (0.25, 0.75)
_SHARE = 4
_HORIZON = (236, 226, 214)
_ZENITH = (214, 168, 120)


class _Planes(NamedTuple):
    """What each pixel needs to know of the plane it sees.

    The homography to level-0 texels (two rows; the third is inverse depth), its change per pixel along the gradient
    of inverse depth, and the camera's distance from the plane.
    """

    column: tuple[Singles, Singles, Singles]
    row: tuple[Singles, Singles, Singles]
    step: tuple[Singles, Singles, Singles]
    distance: Singles


def shade(
    world: World, camera: Camera, pose: Pose, seen: Sight, inverse_depth: Singles, index: NDArray[np.int64]
) -> NDArray[np.uint8]:
    """The picture (H, W, 3) BGR of the facets `index` (into `seen`, or NOTHING) at `inverse_depth`."""
    sky = index == NOTHING
    planes = _per_pixel(world.atlas, seen, index) if len(seen.facet) else None
    if planes is None:
        image = np.zeros((camera.height, camera.width, 3), np.uint8)
    else:
        image = _textured(world.atlas, camera, planes, np.where(sky, np.float32(1), inverse_depth))
    if sky.any():
        image[sky] = _sky(camera, pose)[sky]
    return image


def _per_pixel(atlas: Atlas, seen: Sight, index: NDArray[np.int64]) -> _Planes:
    texels, rho = atlas.texels_per_m, seen.inverse_depth
    place = atlas.patch_px[seen.facet].astype(np.float64)
    column = seen.across * texels + rho * place[:, :1]
    row = seen.along * texels + rho * place[:, 1:]
    gradient = rho[:, :2] / np.maximum(np.linalg.norm(rho[:, :2], axis=1, keepdims=True), 1e-12)
    step = [(line[:, :2] * gradient).sum(axis=1) for line in (column, row, rho)]
    table = np.concatenate([column.T, row.T, step, seen.distance_m[None]]).astype(np.float32)
    # NOTHING takes the last facet's row: the sky is painted over it.
    a, b, c, d, e, f, g, h, i, distance = (values.take(index, mode="wrap") for values in table)
    return _Planes((a, b, c), (d, e, f), (g, h, i), distance)


def _textured(atlas: Atlas, camera: Camera, planes: _Planes, inverse_depth: Singles) -> NDArray[np.uint8]:
    x = np.arange(camera.width, dtype=np.float32)[None, :]
    y = np.arange(camera.height, dtype=np.float32)[:, None]
    column = planes.column[0] * x + planes.column[1] * y + planes.column[2]
    row = planes.row[0] * x + planes.row[1] * y + planes.row[2]
    wanted = _level(atlas, camera, planes.distance, inverse_depth)
    pairs = []
    for rounding, offsets in zip(_ROUNDING, _PROBES, strict=True):
        level = np.clip(wanted + np.float32(rounding), 0, LEVELS - 1).astype(np.intp)
        shrink, origin_x, origin_y = (values.take(level) for values in _levels(atlas))
        samples = []
        for offset in np.array(offsets, np.float32):
            scale = shrink / np.maximum(inverse_depth + planes.step[2] * offset, np.float32(1e-6))
            texel_x = (column + planes.step[0] * offset) * scale + origin_x
            texel_y = (row + planes.step[1] * offset) * scale + origin_y
            samples.append(cv2.remap(atlas.image, texel_x, texel_y, cv2.INTER_LINEAR))
        pairs.append(cv2.addWeighted(samples[0], 0.5, samples[1], 0.5, 0))
    return np.asarray(cv2.addWeighted(pairs[0], 0.5, pairs[1], 0.5, 0), np.uint8)


def _levels(atlas: Atlas) -> tuple[Singles, Singles, Singles]:
    """Per level: its scale, and where its first texel's corner lies (texel centres are at integers)."""
    shrink = np.exp2(-np.arange(LEVELS, dtype=np.float32))
    return shrink, atlas.level_px[:, 0] - np.float32(0.5), atlas.level_px[:, 1] - np.float32(0.5)


def _level(atlas: Atlas, camera: Camera, distance: Singles, inverse_depth: Singles) -> Singles:
    """Mip level whose texels are as large as a probe's footprint, its logarithm to base 2.

    A pixel at depth Z covers Z r / f across and Z^2 r^2 / (f d) along the slope, with r the ray's length for Z = 1 and
    d the distance to the plane; the probes share the latter.
    """
    rays = ray_from_pixel(camera)
    x = (rays[0, 0] * np.arange(camera.width) + rays[0, 2]).astype(np.float32)[None, :]
    y = (rays[1, 1] * np.arange(camera.height) + rays[1, 2]).astype(np.float32)[:, None]
    reach = np.sqrt(1 + x * x + y * y) / inverse_depth
    slope = np.maximum(1, reach / (distance * np.float32(_SHARE)))
    return np.asarray(np.log2(reach * slope * np.float32(atlas.texels_per_m / camera.fx)), np.float32)


def _sky(camera: Camera, pose: Pose) -> NDArray[np.uint8]:
    up = world_from_camera(pose)[2] @ ray_from_pixel(camera)
    x, y = np.arange(camera.width), np.arange(camera.height)
    height = (up[0] * x)[None, :] + (up[1] * y + up[2])[:, None]
    shades = np.linspace(_HORIZON, _ZENITH, 256).astype(np.uint8)
    return np.asarray(shades.take(np.clip(height * 255, 0, 255).astype(np.intp), axis=0), np.uint8)
