"""Which keyframes to hold one against: those that see much of the same, from somewhere else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from covista_service.perception.camera import Floats
from covista_service.perception.surface import cell_centres
from covista_service.perception.visibility import Mask, Seeing, VisibilityOptions, seen

# Cells are enough for a median.
_SAMPLES = 100


@dataclass(frozen=True, slots=True)
class NeighbourOptions:
    """At most `count`, by overlap x parallax. A parallax is best at `best_deg`, and of no use below `least_deg`."""

    count: int = 3
    best_deg: float = 15.0
    least_deg: float = 0.3
    visibility: VisibilityOptions = field(default_factory=VisibilityOptions)


def best_neighbours(
    here: Seeing, others: Sequence[tuple[Seeing, Floats, Floats]], options: NeighbourOptions
) -> list[int]:
    """Indices of the best of `others`, each with its R and t of X_other = R X + t, best first; of equals the first."""
    worth = np.array([_worth(here, other, rotation, translation, options) for other, rotation, translation in others])
    best = np.argsort(-worth, kind="stable")[: options.count]
    return [int(k) for k in best if worth[k] > 0]


def _worth(here: Seeing, other: Seeing, rotation: Floats, translation: Floats, options: NeighbourOptions) -> float:
    """Share of the image that the other sees, times parallax; beyond the best angle images look ever less alike."""
    shared = seen(here, other, rotation, translation, options.visibility).ravel()
    if not shared.any():
        return 0.0
    angle_deg = _median_angle_deg(here, rotation.T @ translation, shared)
    if angle_deg < options.least_deg:
        return 0.0
    share = angle_deg / options.best_deg
    return float(shared.mean() * share / (1 + share**2))


def _median_angle_deg(here: Seeing, to_other: Floats, shared: Mask) -> float:
    """Median angle under which both see the shared cells (ROWS * COLUMNS,); the other's centre is at -`to_other`."""
    some = np.flatnonzero(shared)
    some = some[:: len(some) // _SAMPLES + 1]
    px = cell_centres(here.camera)[some]
    rays = np.column_stack((px, np.ones(len(px)))) @ here.camera.rays_from_pixels.T
    points = rays / here.surface.inverse_depth.ravel()[some][:, None]
    theirs = points + to_other
    across = np.linalg.norm(np.cross(points, theirs), axis=1)
    return float(np.degrees(np.median(np.arctan2(across, (points * theirs).sum(axis=1)))))
