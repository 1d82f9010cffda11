"""Where matched points lie in space: all points at once, as inverse depths, in which noise is uniform."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Floats
from covista_service.perception.epipolar import fundamental, homogeneous, residuals
from covista_service.perception.sightings import Sightings

_IN_IMAGE = np.array([1.0, 1.0, 0.0])


@dataclass(frozen=True, slots=True)
class TriangulationOptions:
    """Points must lie in front of both cameras and agree with both images within `reprojection_px`."""

    reprojection_px: float = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """Points of n matches, in the first camera's frame.

    `rays` (n, 3): (X/Z, Y/Z, 1); `inverse_depths` (n,): 1/Z; `shifts_px` (n,): how fast the point moves in the second
    image with its inverse depth; `parallax_px` (n,): how far it lies there from where it would be if endlessly far
    away; `depths_first`, `depths_second` (n,): Z in both cameras. Meaningless, though finite, where not `kept`.
    """

    rays: Floats
    inverse_depths: Floats
    shifts_px: Floats
    parallax_px: Floats
    depths_first: Floats
    depths_second: Floats
    kept: NDArray[np.bool_]

    def only(self, chosen: NDArray[np.bool_]) -> Triangulation:
        """The points where `chosen` (n,) is true."""
        return Triangulation(*(getattr(self, name)[chosen] for name in self.__slots__))


def triangulate(
    sightings: Sightings, rotation: Floats, translation: Floats, options: TriangulationOptions
) -> Triangulation:
    """Solve Eq. 8 for all matches, after moving both ends onto each other's epipolar lines.

    With camera 1 at the origin, P = (x, y, 1, rho) fulfils the first two rows of A P = 0 for every rho; the other two
    are a + b rho = 0.
    """
    first, second = sightings.first, sightings.second
    one, other, errors = _corrected(sightings, fundamental(first, second, rotation, translation))
    rays = one @ first.rays_from_pixels.T
    away = rays @ rotation.T @ second.matrix.T  # the point endlessly far away, in the second image
    nearer = second.matrix @ translation
    a = other[:, :2] * away[:, 2:] - away[:, :2]
    b = other[:, :2] * nearer[2] - nearer[:2]
    squared = (b * b).sum(axis=1)
    seen = squared > 0
    rho = np.where(seen, -(a * b).sum(axis=1) / np.where(seen, squared, 1.0), 0.0)
    ratio = away[:, 2] + rho * nearer[2]  # Z_2 / Z_1
    kept = seen & (rho > 0) & (ratio > 0) & (errors <= options.reprojection_px)
    speed, ratio, rho = np.sqrt(squared), np.where(kept, ratio, 1.0), np.where(kept, rho, 1.0)
    ahead = away[:, 2] > 0
    parallax = np.where(ahead, speed * rho / np.where(ahead, away[:, 2], 1.0), np.inf)
    return Triangulation(rays, rho, speed / ratio, parallax, 1.0 / rho, ratio / rho, kept)


def _corrected(sightings: Sightings, F: Floats) -> tuple[Floats, Floats, Floats]:
    """Matches as homogeneous points (n, 3), moved by Sampson's correction, and by how many px (n,)."""
    start = homogeneous(sightings.first_px), homogeneous(sightings.second_px)
    one, other = start
    for _ in range(2):
        error, norm = residuals(F, one, other)
        step = (error / norm)[:, None] * _IN_IMAGE
        one, other = one - step * (other @ F), other - step * (one @ F.T)
    errors = np.sqrt(((one - start[0]) ** 2 + (other - start[1]) ** 2).sum(axis=1))
    return one, other, errors
