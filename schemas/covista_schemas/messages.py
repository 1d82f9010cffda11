"""What a robot says, as Python sees it: the counterpart of robot.proto.

Frames: OpenCV camera axes (x right, y down, z forward); poses are of the camera in the common world frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

UNIT_TOLERANCE = 1e-3
_Finite = Annotated[float, Field(allow_inf_nan=False)]
_Focal = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_Pixels = Annotated[int, Field(gt=0, le=65_535)]

COEFFICIENT_COUNTS: dict[str, tuple[int, ...]] = {"none": (0,), "plumb_bob": (4, 5), "equidistant": (4,)}


class FeatureKind(StrEnum):
    """Kinds of descriptors; only descriptors of one kind can be compared."""

    ROOTSIFT = "rootsift"
    ORB = "orb"


DESCRIPTOR_BYTES: dict[FeatureKind, int] = {FeatureKind.ROOTSIFT: 128, FeatureKind.ORB: 32}
# RootSIFT descriptors have unit length; in bytes 512 stands for 1, and what saturates at 255 is rare.
ROOTSIFT_SCALE = 512.0
MAX_FEATURES = 20_000
MAX_THUMBNAIL_BYTES = 64 * 1024


class Distortion(BaseModel):
    """Lens distortion in OpenCV's terms; coefficients k1 k2 p1 p2 [k3] (plumb_bob) or k1..k4 (equidistant)."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    model: Literal["none", "plumb_bob", "equidistant"] = "none"
    coefficients: tuple[_Finite, ...] = ()

    @model_validator(mode="after")
    def _count(self) -> Self:
        allowed = COEFFICIENT_COUNTS[self.model]
        if len(self.coefficients) not in allowed:
            expected = " or ".join(str(n) for n in allowed)
            raise ValueError(f"{self.model} takes {expected} coefficients, not {len(self.coefficients)}")
        return self


class Camera(BaseModel):
    """Pinhole camera in pixels; pixel centres at integers, image spans [-.5, width - .5] x [-.5, height - .5]."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    fx: _Focal
    fy: _Focal
    cx: _Finite
    cy: _Finite
    width: _Pixels
    height: _Pixels
    distortion: Distortion = Distortion()


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of a camera in the world: `position_m` and `orientation_xyzw` = world_from_camera, unit quaternion.

    `time_ns` is sensor time since the epoch. `covariance` is empty or 6 x 6, row-major, of (position m, rotation
    vector rad) in the world frame. Raises ValueError for numbers that are not finite or a quaternion that is not unit.
    """

    position_m: tuple[float, float, float]
    orientation_xyzw: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    time_ns: int = 0
    covariance: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _check_numbers("position_m", self.position_m, 3)
        _check_numbers("orientation_xyzw", self.orientation_xyzw, 4)
        norm = math.hypot(*self.orientation_xyzw)
        if abs(norm - 1.0) > UNIT_TOLERANCE:
            raise ValueError(f"orientation_xyzw has length {norm:.4g}, not 1")
        if self.covariance:
            _check_numbers("covariance", self.covariance, 36)


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Features of one image: `keypoints_px` (n, 2) float32 and `descriptors` (n, 128 | 32) uint8.

    RootSIFT descriptors are stored as 512 x their value; `from_arrays` takes float descriptors too.
    """

    kind: FeatureKind
    keypoints_px: NDArray[np.float32]
    descriptors: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.keypoints_px)

    @classmethod
    def from_arrays(
        cls, kind: FeatureKind | str, keypoints_px: NDArray[np.generic], descriptors: NDArray[np.generic]
    ) -> Self:
        """Check shapes, quantise float RootSIFT descriptors, and raise ValueError for what does not fit."""
        kind = FeatureKind(kind)
        points = np.ascontiguousarray(keypoints_px, np.float32)
        if points.ndim != 2 or points.shape[1] != 2:
            raise ValueError(f"keypoints_px has shape {points.shape}, not (n, 2)")
        if not np.isfinite(points).all():
            raise ValueError("keypoints_px has numbers that are not finite")
        expected = (len(points), DESCRIPTOR_BYTES[kind])
        if descriptors.shape != expected:
            raise ValueError(f"descriptors have shape {descriptors.shape}, not {expected}")
        if descriptors.dtype != np.uint8:
            if kind is not FeatureKind.ROOTSIFT:
                raise ValueError(f"{kind} descriptors are uint8, not {descriptors.dtype}")
            descriptors = quantise_rootsift(descriptors)
        return cls(kind, points, np.ascontiguousarray(descriptors, np.uint8))


@dataclass(frozen=True, slots=True, eq=False)
class Keyframe:
    """An image (encoded bytes) or its features, with camera and camera pose; exactly one of the two is given.

    `boot` and `sequence` name it for ever: sequence counts from 0 per boot.
    """

    robot: str
    boot: str
    sequence: int
    camera: Camera
    pose: Pose
    image: bytes | None = None
    features: Features | None = None
    thumbnail: bytes | None = None

    def __post_init__(self) -> None:
        if (self.image is None) == (self.features is None):
            raise ValueError("a keyframe carries either an image or features")


@dataclass(frozen=True, slots=True)
class PoseUpdate:
    """A camera pose between keyframes; `sequence` counts poses from 0 per boot."""

    robot: str
    boot: str
    sequence: int
    pose: Pose


def quantise_rootsift(descriptors: NDArray[np.generic]) -> NDArray[np.uint8]:
    """RootSIFT (n, 128) in [0, 1] as bytes, 512 standing for 1; raises ValueError where not finite."""
    values = np.asarray(descriptors, np.float32)
    if not np.isfinite(values).all():
        raise ValueError("descriptors have numbers that are not finite")
    scaled: NDArray[np.uint8] = np.clip(np.rint(values * ROOTSIFT_SCALE), 0, 255).astype(np.uint8)
    return scaled


def check_inside(keypoints_px: NDArray[np.float32], camera: Camera) -> None:
    """Raise ValueError unless all points (n, 2) lie in the camera's image."""
    high = np.array([camera.width, camera.height]) - 0.5
    if not ((keypoints_px >= -0.5) & (keypoints_px <= high)).all():
        raise ValueError(f"points outside of {camera.width} x {camera.height} px")


def _check_numbers(name: str, values: tuple[float, ...], count: int) -> None:
    if len(values) != count:
        raise ValueError(f"{name} has {len(values)} numbers, not {count}")
    if not all(math.isfinite(value) for value in values):
        raise ValueError(f"{name} has numbers that are not finite")
