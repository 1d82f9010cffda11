"""What one camera sees of another's surface: what lies in its image, with nothing of its own surface before it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats
from covista_service.perception.compiled import compiled
from covista_service.perception.surface import COLUMNS, ROWS, Surface

Mask = NDArray[np.bool_]
_AHEAD = 1e-9


@dataclass(frozen=True, slots=True)
class VisibilityOptions:
    """A point is hidden if the other camera's surface is nearer by `tolerance` of its inverse depth plus sigma.

    And by more than `parallax_px` in the image, or tiny baselines would turn noise into occlusions. Between keyframes
    that no chain of matches connects, depths have scales of their own: there the median ratio is taken out and
    `unconnected_tolerance` holds.
    """

    tolerance: float = 0.05
    parallax_px: float = 4.0
    unconnected_tolerance: float = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class Seeing:
    """A camera and what it sees: its surface."""

    camera: Camera
    surface: Surface


def seen(
    first: Seeing,
    second: Seeing,
    rotation: Floats,
    translation: Floats,
    options: VisibilityOptions,
    *,
    connected: bool = True,
) -> Mask:
    """Which cells (ROWS, COLUMNS) of the first image the second camera sees, for X_2 = R X_1 + t.

    Their share is q of Eq. 16. A pixel v at inverse depth rho lies at A v + rho b in the other image, up to scale.
    """
    back = first.camera.matrix @ rotation.T
    hidden_from = options.tolerance if connected else options.unconnected_tolerance
    return _seen(
        np.column_stack(
            (second.camera.matrix @ rotation @ first.camera.rays_from_pixels, second.camera.matrix @ translation)
        ),
        np.column_stack((back @ second.camera.rays_from_pixels, -back @ translation)),
        np.array([first.camera.width, first.camera.height, second.camera.width, second.camera.height], np.float64),
        first.surface.inverse_depth,
        second.surface.inverse_depth,
        second.surface.sigma,
        hidden_from,
        options.parallax_px,
        connected,
    )


@compiled
def _seen(
    forth: Floats,
    back: Floats,
    sizes: Floats,
    rho: Floats,
    other_rho: Floats,
    other_sigma: Floats,
    tolerance: float,
    parallax_px: float,
    connected: bool,
) -> Mask:
    rows, columns = rho.shape
    mask = np.zeros((rows, columns), np.bool_)
    ratio = 1.0 if connected else _median_ratio(forth, sizes, rho, other_rho)
    for r in range(rows):
        for c in range(columns):
            u, v, here = _moved(forth, sizes, r, c, rho[r, c])
            if here <= 0:
                continue
            i, j = int((v + 0.5) * rows / sizes[3]), int((u + 0.5) * columns / sizes[2])
            there = _sampled(other_rho, u, v, sizes) * ratio
            if connected:
                nearer = here < there * (1 - tolerance - other_sigma[i, j])
                mask[r, c] = not (nearer and _parallax(back, u, v, here, there) > parallax_px)
            else:
                mask[r, c] = here >= there * (1 - tolerance)
    return mask


@compiled
def _moved(forth: Floats, sizes: Floats, r: int, c: int, rho: float) -> tuple[float, float, float]:
    """Where a cell's centre lies in the other image (u, v), and its inverse depth there; 0 if it is not in it."""
    x = (c + 0.5) * sizes[0] / COLUMNS - 0.5
    y = (r + 0.5) * sizes[1] / ROWS - 0.5
    w = forth[2, 0] * x + forth[2, 1] * y + forth[2, 2] + rho * forth[2, 3]
    if w <= _AHEAD:
        return 0.0, 0.0, 0.0
    u = (forth[0, 0] * x + forth[0, 1] * y + forth[0, 2] + rho * forth[0, 3]) / w
    v = (forth[1, 0] * x + forth[1, 1] * y + forth[1, 2] + rho * forth[1, 3]) / w
    inside = -0.5 <= u < sizes[2] - 0.5 and -0.5 <= v < sizes[3] - 0.5
    return u, v, rho / w if inside else 0.0


@compiled
def _sampled(grid: Floats, u: float, v: float, sizes: Floats) -> float:
    """Bilinear between the cells' centres, constant beyond the outermost."""
    rows, columns = grid.shape
    x = min(max((u + 0.5) * columns / sizes[2] - 0.5, 0.0), columns - 1.0)
    y = min(max((v + 0.5) * rows / sizes[3] - 0.5, 0.0), rows - 1.0)
    j, i = min(int(x), columns - 2), min(int(y), rows - 2)
    x, y = x - j, y - i
    upper = (1 - x) * grid[i, j] + x * grid[i, j + 1]
    lower = (1 - x) * grid[i + 1, j] + x * grid[i + 1, j + 1]
    return float((1 - y) * upper + y * lower)


@compiled
def _parallax(back: Floats, u: float, v: float, one: float, other: float) -> float:
    """How far apart, in px of the first image, two inverse depths along a pixel of the second lie."""
    x = back[0, 0] * u + back[0, 1] * v + back[0, 2]
    y = back[1, 0] * u + back[1, 1] * v + back[1, 2]
    w = back[2, 0] * u + back[2, 1] * v + back[2, 2]
    w1, w2 = w + one * back[2, 3], w + other * back[2, 3]
    if w1 <= _AHEAD or w2 <= _AHEAD:
        return np.inf
    across = (x + one * back[0, 3]) / w1 - (x + other * back[0, 3]) / w2
    along = (y + one * back[1, 3]) / w1 - (y + other * back[1, 3]) / w2
    return float(np.sqrt(across * across + along * along))


@compiled
def _median_ratio(forth: Floats, sizes: Floats, rho: Floats, other_rho: Floats) -> float:
    """Median of the first surface's inverse depths over the second's, where they meet; 1 if nowhere."""
    rows, columns = rho.shape
    ratios = np.empty(rows * columns)
    count = 0
    for r in range(rows):
        for c in range(columns):
            u, v, here = _moved(forth, sizes, r, c, rho[r, c])
            if here > 0:
                ratios[count] = here / _sampled(other_rho, u, v, sizes)
                count += 1
    return float(np.median(ratios[:count])) if count else 1.0
