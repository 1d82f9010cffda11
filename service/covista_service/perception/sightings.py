"""What two cameras have both sighted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Matches of two cameras: `first_px`, `second_px` (n, 2) in ideal pixels."""

    first: Camera
    second: Camera
    first_px: Floats
    second_px: Floats

    def only(self, chosen: NDArray[np.bool_]) -> Sightings:
        """The matches where `chosen` (n,) is true."""
        return Sightings(self.first, self.second, self.first_px[chosen], self.second_px[chosen])
