"""What a robot says, as Python sees it: the counterpart of robot.proto.

Frames: OpenCV camera axes (x right, y down, z forward); poses are of the camera in the common world frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

UNIT_TOLERANCE = 1e-3
# Bounds far beyond what makes sense, so that squares and ratios of what one robot says stay finite for all others.
MAX_DISTANCE_M = 1e12
_Coefficient = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
_Focal = Annotated[float, Field(ge=0.1, le=1e6, allow_inf_nan=False)]
_Centre = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
_Pixels = Annotated[int, Field(gt=0, le=65_535)]

COEFFICIENT_COUNTS: dict[str, tuple[int, ...]] = {"none": (0,), "plumb_bob": (4, 5), "equidistant": (4,)}


class FeatureKind(StrEnum):
    """Kinds of descriptors; only descriptors of one kind can be compared."""

    ROOTSIFT = "rootsift"
    ORB = "orb"


DESCRIPTOR_BYTES: dict[FeatureKind, int] = {FeatureKind.ROOTSIFT: 128, FeatureKind.ORB: 32}
# RootSIFT descriptors have unit length; in bytes 512 stands for 1, and what saturates at 255 is rare.
ROOTSIFT_SCALE = 512.0
# Matching compares every feature with every other one: this many bound the memory of a survey to some 100 MB a matrix.
MAX_FEATURES = 5_000
MAX_THUMBNAIL_BYTES = 64 * 1024


class Distortion(BaseModel):
    """Lens distortion in OpenCV's terms; coefficients k1 k2 p1 p2 [k3] (plumb_bob) or k1..k4 (equidistant)."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    model: Literal["none", "plumb_bob", "equidistant"] = "none"
    coefficients: tuple[_Coefficient, ...] = ()

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
    cx: _Centre
    cy: _Centre
    width: _Pixels
    height: _Pixels
    distortion: Distortion = Distortion()


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of a camera in the world: `position_m` and `orientation_xyzw` = world_from_camera, unit quaternion.

    `time_ns` is sensor time since the epoch. `covariance` is empty or 6 x 6, row-major, of (position m, rotation
    vector rad) in the world frame. Sequences of any kind are taken. Raises ValueError that names what is wrong:
    numbers that are not finite, a position beyond `MAX_DISTANCE_M`, a quaternion that is not unit.
    """

    position_m: tuple[float, float, float]
    orientation_xyzw: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    time_ns: int = 0
    covariance: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name, count in (("position_m", 3), ("orientation_xyzw", 4)):
            object.__setattr__(self, name, numbers(name, getattr(self, name), count))
        if len(self.covariance):
            object.__setattr__(self, "covariance", numbers("covariance", self.covariance, 36))
        if max(map(abs, self.position_m)) > MAX_DISTANCE_M:
            raise ValueError(f"position_m: farther than {MAX_DISTANCE_M:.0e} m from the origin")
        norm = math.hypot(*self.orientation_xyzw)
        if abs(norm - 1.0) > UNIT_TOLERANCE:
            raise ValueError(f"orientation_xyzw: a quaternion of norm {norm:.4g}, not 1")
        if not (isinstance(self.time_ns, int | np.integer) and -(2**63) <= self.time_ns < 2**63):
            raise ValueError(f"time_ns: {self.time_ns!r} is not a whole number of 64 bits")


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
        if kind not in tuple(FeatureKind):
            raise ValueError(f"kind: {kind!r:.40}, not one of {', '.join(FeatureKind)}")
        kind = FeatureKind(kind)
        points = np.ascontiguousarray(keypoints_px, np.float32)
        if points.ndim != 2 or points.shape[1] != 2:
            raise ValueError(f"keypoints: shape {points.shape}, not (n, 2)")
        if not np.isfinite(points).all():
            raise ValueError("keypoints: numbers that are not finite")
        if len(points) > MAX_FEATURES:
            raise ValueError(f"keypoints: {len(points)} points, more than {MAX_FEATURES}")
        expected = (len(points), DESCRIPTOR_BYTES[kind])
        if descriptors.shape != expected:
            raise ValueError(f"descriptors: shape {descriptors.shape}, not {expected}")
        if descriptors.dtype != np.uint8:
            if kind is not FeatureKind.ROOTSIFT:
                raise ValueError(f"descriptors: of {kind} they are uint8, not {descriptors.dtype}")
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
        raise ValueError("descriptors: numbers that are not finite")
    scaled: NDArray[np.uint8] = np.clip(np.rint(values * ROOTSIFT_SCALE), 0, 255).astype(np.uint8)
    return scaled


def check_inside(keypoints_px: NDArray[np.float32], camera: Camera) -> None:
    """Raise ValueError unless all points (n, 2) lie in the camera's image."""
    high = np.array([camera.width, camera.height]) - 0.5
    if not ((keypoints_px >= -0.5) & (keypoints_px <= high)).all():
        raise ValueError(f"keypoints: points outside of {camera.width} x {camera.height} px")


def numbers(name: str, values: Sequence[float], count: int) -> tuple[float, ...]:
    """`count` finite numbers as floats; ValueError that names them otherwise."""
    if len(values) != count:
        raise ValueError(f"{name}: {len(values)} numbers, not {count}")
    try:
        taken = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: {values!r:.80} are not numbers") from None
    if not all(map(math.isfinite, taken)):
        raise ValueError(f"{name}: numbers that are not finite")
    return taken
