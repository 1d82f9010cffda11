"""The interpolated surface, and the dense one where depth jumps: each where it is the better.

Between jumps a robust affine fit to good points beats a sweep's noise; at a jump no interpolation knows the edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from covista_service.perception.scene import Scene
from covista_service.perception.surface import Surface


@dataclass(frozen=True, slots=True)
class JumpOptions:
    """Depth jumps where it differs by more than `jump` between a cell and one beside it; `around` cells belong to it.

    There the dense surface counts, if it differs from the other by more than `difference`.
    """

    jump: float = 0.10
    around: int = 2
    difference: float = 0.05


def mixed(scene: Scene, dense: Scene, options: JumpOptions) -> Scene:
    """`scene` with the surfaces of `dense`, the same keyframes with dense surfaces, at its jumps of depth."""
    surfaces = [
        one if one is None or other is None or one is other else _mixed(one, other, options)
        for one, other in zip(scene.surfaces, dense.surfaces, strict=True)
    ]
    return scene.with_surfaces(surfaces)


def _mixed(smooth: Surface, dense: Surface, options: JumpOptions) -> Surface:
    rho = dense.inverse_depth
    square = np.ones((3, 3), np.uint8)
    jumps = cv2.dilate(rho, square) > (1 + options.jump) * cv2.erode(rho, square)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    near = cv2.dilate(jumps.astype(np.uint8), cross, iterations=options.around) > 0
    chosen = near & (np.abs(np.log(rho / smooth.inverse_depth)) > options.difference)
    return Surface(
        np.where(chosen, rho, smooth.inverse_depth),
        np.where(chosen, dense.sigma, smooth.sigma),
    )
