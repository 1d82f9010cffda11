"""Placeholder until regions land."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats


def polygons(mask: NDArray[np.bool_], camera: Camera) -> list[Floats]:
    """Polygons."""
    return []
