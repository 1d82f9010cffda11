"""How far a view frustum may be off, where in the world it lies, and how much a camera's view changes by a motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats, Pose

# A reported covariance counts with two standard deviations along its worst axis.
_DEVIATIONS = 2.0
# Beyond it a doubt about the direction says no more than that the camera may look anywhere ahead.
_MOST_RAD = math.radians(45)
# Whatever is reported, sums of it are finite.
_MOST_VARIANCE = 1e24

# Least and greatest coordinates of a box in the world, in metres; infinite where it is endless.
Box = tuple[tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True, slots=True)
class Doubt:
    """How far a pose may be off: by an angle, and by a distance that may grow with the depth of the scene.

    The defaults are for a pose of which nothing is said.
    """

    angle_rad: float = math.radians(3)
    distance_m: float = 0.0
    depth_share: float = 0.03

    @classmethod
    def of(cls, covariance: NDArray[np.floating]) -> Doubt:
        """From the covariance (6, 6) of position (m) and rotation vector (rad); what is no covariance counts as 0."""
        sound = np.clip(covariance, -_MOST_VARIANCE, _MOST_VARIANCE)
        both = (sound + sound.T) / 2
        distance_m, angle_rad = (
            _DEVIATIONS * math.sqrt(max(0.0, float(np.linalg.eigvalsh(block)[-1])))
            for block in (both[:3, :3], both[3:, 3:])
        )
        return cls(min(angle_rad, _MOST_RAD), distance_m, 0.0)

    def at_least(self, angle_rad: float, distance_m: float) -> Doubt:
        """The same, if it is not less."""
        most_rad = min(max(self.angle_rad, angle_rad), _MOST_RAD)
        return Doubt(most_rad, max(self.distance_m, distance_m), self.depth_share)

    def off_m(self, depth_m: float) -> float:
        """The distance in a scene of this depth."""
        return self.distance_m + self.depth_share * depth_m


EXACT = Doubt(0.0, 0.0, 0.0)
UNTOLD = Doubt()


def box_of(corners: Floats, directions: Floats, margin_m: float = 0.0) -> Box:
    """The box around corners (n, 3), grown by a margin, and all that lies from there in `directions` (k, 3)."""
    ahead, behind = (directions > 0).any(axis=0), (directions < 0).any(axis=0)
    low = np.where(behind, -np.inf, corners.min(axis=0) - margin_m).tolist()
    high = np.where(ahead, np.inf, corners.max(axis=0) + margin_m).tolist()
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def change(camera: Camera, former: Pose, pose: Pose, depth_m: float | None) -> float:
    """How much of its view a camera has changed: the turn as a share of its field, the way as a share of the depth.

    Where no depth is known the turn alone counts.
    """
    if former is pose:
        return 0.0
    # trace(A' B) is the sum of the products of their entries.
    cosine = (float(np.vdot(former.world_from_camera, pose.world_from_camera)) - 1) / 2
    turn = math.acos(min(1.0, max(-1.0, cosine)))
    field = 2 * math.atan2(camera.width, 2 * camera.matrix.item(0, 0))
    if not depth_m:
        return turn / field
    step_m = pose.centre_m - former.centre_m
    return turn / field + math.sqrt(float(step_m @ step_m)) / depth_m
