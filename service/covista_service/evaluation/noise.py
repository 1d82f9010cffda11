"""Errors put on reported poses, to see what a method makes of them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from covista_service.perception.camera import Pose


@dataclass(frozen=True, slots=True)
class PoseNoise:
    """Rotation by |N(0, `deg`)| about a random axis; translation of RMS `share` of the set's median depth."""

    deg: float = 0.0
    share: float = 0.0

    @property
    def is_none(self) -> bool:
        """Are poses left as they are?"""
        return not (self.deg or self.share)


NO_NOISE = PoseNoise()


def disturbed(pose: Pose, noise: PoseNoise, depth: float, rng: np.random.Generator) -> Pose:
    """`pose` with errors drawn from `rng`; `depth` is what the share of the translation refers to."""
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    turn, _ = cv2.Rodrigues(axis * np.radians(abs(rng.normal(0.0, noise.deg))))
    # The RMS of the length of an isotropic normal vector is sqrt(3) times that of a component.
    shift = rng.normal(0.0, noise.share * depth / np.sqrt(3.0), size=3)
    return Pose(pose.world_from_camera @ turn, pose.centre_m + shift)
