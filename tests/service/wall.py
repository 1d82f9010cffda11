"""Robots that look at one wall: messages as they cross the air, with an overlap that is known."""

import cv2
import numpy as np
from covista_schemas import codec, features
from covista_schemas.messages import Camera, Features, Keyframe, Pose, PoseUpdate
from numpy.typing import NDArray

CAMERA = Camera(fx=300, fy=300, cx=159.5, cy=119.5, width=320, height=240)
DEPTH_M = 4.0
_FACING: NDArray[np.float64] = np.random.default_rng(0).uniform([-6, -2, DEPTH_M], [6, 2, DEPTH_M], (4000, 3))
_BITS = np.random.default_rng(1).random((4000, 128), np.float32)
_NAMES = np.sqrt(_BITS / _BITS.sum(axis=1, keepdims=True))


def overlap(distance_m: float) -> float:
    """The share of the wall in one image that a robot so far beside sees too."""
    return max(0.0, 1.0 - CAMERA.fx * distance_m / DEPTH_M / CAMERA.width)


def seen_from(x_m: float) -> Features:
    """What a camera at (x, 0, 0) that looks along z sees of the wall."""
    rays = _FACING - [x_m, 0, 0]
    points_px = rays[:, :2] / rays[:, 2:] * CAMERA.fx + [CAMERA.cx, CAMERA.cy]
    inside = ((points_px > 0) & (points_px < [CAMERA.width - 1, CAMERA.height - 1])).all(axis=1)
    return Features.from_arrays("rootsift", points_px[inside], _NAMES[inside])


def keyframe(robot: str, x_m: float = 0.0, *, boot: str = "b0", sequence: int = 0, time_ns: int = 0) -> Keyframe:
    """A keyframe of features."""
    return Keyframe(robot, boot, sequence, CAMERA, Pose((x_m, 0, 0), time_ns=time_ns), features=seen_from(x_m))


def keyframe_bytes(robot: str, x_m: float = 0.0, *, boot: str = "b0", sequence: int = 0, time_ns: int = 0) -> bytes:
    """The keyframe on the wire."""
    return codec.encode_keyframe(keyframe(robot, x_m, boot=boot, sequence=sequence, time_ns=time_ns))


def picture() -> NDArray[np.uint8]:
    """A picture with texture, of the camera's size."""
    noise = np.random.default_rng(2).integers(0, 256, (30, 40, 3), np.uint8)
    return np.asarray(cv2.resize(noise, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_CUBIC), np.uint8)


def picture_bytes(robot: str, image: bytes | None = None, *, boot: str = "b0", sequence: int = 0) -> bytes:
    """A keyframe with a picture on the wire."""
    data = features.encode_jpeg(picture()) if image is None else image
    return codec.encode_keyframe(Keyframe(robot, boot, sequence, CAMERA, Pose((0, 0, 0)), image=data))


def pose_bytes(robot: str, x_m: float = 0.0, *, boot: str = "b0", sequence: int = 0, time_ns: int = 0) -> bytes:
    """A pose on the wire."""
    return codec.encode_pose(PoseUpdate(robot, boot, sequence, Pose((x_m, 0, 0), time_ns=time_ns)))
