"""Semi-global smoothing of labels over an image: along four paths, small steps cheap, jumps cheap only at edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled

Singles = NDArray[np.float32]
_NEVER = np.float32(1e9)


@dataclass(frozen=True, slots=True)
class SmoothingOptions:
    """`step` is the penalty for a step to the next label, `jump` for any other.

    A jump costs `jump` / (1 + difference in grey / `edge`), but never less than a step.
    """

    step: float = 0.05
    jump: float = 0.8
    edge: float = 20.0


def smoothed(costs: Singles, grey: Singles, options: SmoothingOptions) -> Singles:
    """Costs (h, w, L), summed over the cheapest paths that reach each pixel from four sides (Hirschmueller 2008)."""
    total = np.zeros_like(costs)
    for down, across in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        _add_path(
            costs,
            grey,
            total,
            (down, across),
            np.float32(options.step),
            np.float32(options.jump),
            np.float32(options.edge),
        )
    return total


def lowest(costs: Singles) -> NDArray[np.float64]:
    """The label (h, w) of least cost, between labels at the vertex of a parabola."""
    return _lowest(costs)


@compiled
def _add_path(
    costs: Singles,
    grey: Singles,
    total: Singles,
    direction: tuple[int, int],
    step: np.float32,
    jump: np.float32,
    edge: np.float32,
) -> None:
    height, width, labels = costs.shape
    down, across = direction
    # A label more at either end, which nothing can come from.
    path = np.full((height, width, labels + 2), _NEVER)
    for r in range(height):
        y = height - 1 - r if down < 0 else r
        for c in range(width):
            x = width - 1 - c if across < 0 else c
            i, j = y - down, x - across
            if i < 0 or j < 0 or i >= height or j >= width:
                path[y, x, 1:-1] = costs[y, x]
            else:
                apart = max(step, jump / (np.float32(1) + abs(grey[y, x] - grey[i, j]) / edge))
                _advance(path[i, j], costs[y, x], step, apart, path[y, x])
            for k in range(labels):
                total[y, x, k] += path[y, x, k + 1]


@compiled
def _advance(before: Singles, cost: Singles, step: np.float32, jump: np.float32, after: Singles) -> None:
    """One pixel along a path: each label from itself, from its neighbours, or from the cheapest of all."""
    least = before[1]
    for k in range(2, len(cost) + 1):
        least = before[k] if before[k] < least else least
    for k in range(len(cost)):
        beside = before[k] if before[k] < before[k + 2] else before[k + 2]
        beside += step
        come = before[k + 1] if before[k + 1] < beside else beside
        come -= least
        after[k + 1] = cost[k] + (come if come < jump else jump)


@compiled
def _lowest(costs: Singles) -> NDArray[np.float64]:
    height, width, labels = costs.shape
    found = np.empty((height, width))
    for y in range(height):
        for x in range(width):
            k = np.argmin(costs[y, x])
            found[y, x] = k
            if 0 < k < labels - 1:
                left, here, right = costs[y, x, k - 1], costs[y, x, k], costs[y, x, k + 1]
                bend = left - 2 * here + right
                if bend > 0:
                    found[y, x] += 0.5 * (left - right) / bend
    return found
