"""Which depths of one map another keyframe's map confirms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats
from covista_service.perception.sweep import Beside, Glimpse, transfer

Mask = NDArray[np.bool_]
_AHEAD = 1e-9


def confirmed(
    here: Glimpse, other: Beside, inverse_depth: Floats, others_inverse_depth: Floats, tolerance: float, room: float
) -> Mask:
    """Pixels (h, w) that lie, seen from the other keyframe, at the depth (h', w') which that one found there.

    Within `tolerance` of the inverse depth, plus `room` in 1/m.
    """
    return _confirmed(transfer(here, other), inverse_depth, others_inverse_depth, tolerance, room)


@compiled
def _confirmed(forth: Floats, rho: Floats, others: Floats, tolerance: float, room: float) -> Mask:
    height, width = rho.shape
    bottom, right = others.shape[0] - 0.5, others.shape[1] - 0.5
    mask = np.zeros((height, width), np.bool_)
    for y in range(height):
        for x in range(width):
            w = forth[2, 0] * x + forth[2, 1] * y + forth[2, 2] + forth[2, 3] * rho[y, x]
            if w <= _AHEAD:
                continue
            u = (forth[0, 0] * x + forth[0, 1] * y + forth[0, 2] + forth[0, 3] * rho[y, x]) / w
            v = (forth[1, 0] * x + forth[1, 1] * y + forth[1, 2] + forth[1, 3] * rho[y, x]) / w
            moved = rho[y, x] / w
            if -0.5 <= u < right and -0.5 <= v < bottom:
                found = others[int(v + 0.5), int(u + 0.5)]
                mask[y, x] = abs(found - moved) < tolerance * moved + room
    return mask
