"""Where matched points lie in space: all points at once, as inverse depths, in which noise is uniform."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats
from covista_service.perception.epipolar import fundamental, homogeneous, residuals


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
    first: Camera,
    second: Camera,
    rotation: Floats,
    translation: Floats,
    first_px: Floats,
    second_px: Floats,
    options: TriangulationOptions,
) -> Triangulation:
    """Solve Eq. 8 for matches (n, 2), after moving both ends onto each other's epipolar lines.

    With camera 1 at the origin, P = (x, y, 1, rho) fulfils the first two rows of A P = 0 for every rho; the other two
    are a + b rho = 0.
    """
    one, other, errors = _corrected(first, second, rotation, translation, homogeneous(first_px), homogeneous(second_px))
    rays = one @ np.linalg.inv(first.matrix).T
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


def _corrected(
    first: Camera, second: Camera, rotation: Floats, translation: Floats, one: Floats, other: Floats
) -> tuple[Floats, Floats, Floats]:
    """Homogeneous matches moved by Sampson's correction, and by how many px (n,)."""
    F = fundamental(first, second, rotation, translation)
    errors = np.zeros(len(one))
    moved_one, moved_other = one, other
    for _ in range(2):
        step, norm = residuals(F, moved_one, moved_other)
        scale = (step / norm)[:, None]
        step_one = scale * (moved_other @ F)[:, :2]
        step_other = scale * (moved_one @ F.T)[:, :2]
        moved_one = np.column_stack((moved_one[:, :2] - step_one, moved_one[:, 2]))
        moved_other = np.column_stack((moved_other[:, :2] - step_other, moved_other[:, 2]))
    errors = np.sqrt(((moved_one - one) ** 2 + (moved_other - other) ** 2).sum(axis=1))
    return moved_one, moved_other, errors
