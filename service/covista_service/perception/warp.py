"""A surface carried over into another view of the same scene, for a keyframe that has no points of its own yet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from covista_service.perception.agreement import CARRIED, DepthPoints
from covista_service.perception.camera import Camera, Floats
from covista_service.perception.surface import Surface, SurfaceOptions, cell_centres, interpolate

# Every third cell either way fixes a surface that is no finer than its cells.
_STRIDE = 3
_AHEAD = 1e-9
# How far beyond the new image, in widths, a point still says something of the cells at its border.
_BEYOND = 0.25
# What is carried over grows this much less sure each time, as a share of the depth, to no more than the second.
_DOUBT, _MOST_DOUBT = 0.05, 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """A surface as `camera` saw it, and the motion X_2 = R X_1 + t to another view."""

    surface: Surface
    camera: Camera
    rotation: Floats
    translation: Floats

    def points(self, to: Camera) -> DepthPoints:
        """Some points of the surface as the other camera sees them, less sure than they were; perhaps none."""
        return _carried(self.surface, self.camera, self.rotation, self.translation, to)

    def over(self, to: Camera, options: SurfaceOptions) -> Surface | None:
        """The surface in the other view; None if none of it lies before that camera."""
        points = self.points(to)
        return interpolate(points, to, options) if len(points) else None


def _carried(surface: Surface, camera: Camera, rotation: Floats, translation: Floats, to: Camera) -> DepthPoints:
    grid = np.zeros(surface.inverse_depth.shape, np.bool_)
    grid[_STRIDE // 2 :: _STRIDE, _STRIDE // 2 :: _STRIDE] = True
    rho, sigma = surface.inverse_depth[grid], surface.sigma[grid]
    pixels = cell_centres(camera)[grid.ravel()]
    rays = np.column_stack((pixels, np.ones(len(pixels)))) @ camera.rays_from_pixels.T
    # X / Z_1 for each point, so that far points need no division by what is nearly nothing.
    there = rays @ rotation.T + rho[:, None] * translation
    ahead = there[:, 2] > _AHEAD
    there, rho, sigma = there[ahead], rho[ahead], sigma[ahead]
    seen = (there / there[:, 2:]) @ to.matrix.T
    margin = _BEYOND * to.width
    near = (seen[:, :2] > -margin).all(axis=1) & (seen[:, 0] < to.width + margin) & (seen[:, 1] < to.height + margin)
    depths = (rho / there[:, 2])[near]
    sigmas = np.minimum(np.hypot(sigma[near], _DOUBT), _MOST_DOUBT) * depths
    return DepthPoints(seen[near, :2], depths, sigmas, np.full(len(depths), CARRIED))
