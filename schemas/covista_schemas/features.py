"""Extraction of image features: one definition for rovers and station, so that descriptors match across robots.

OpenCV (extra `vision`) is imported when a function is called, not with this module.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from covista_schemas.errors import MissingExtraError
from covista_schemas.messages import DESCRIPTOR_BYTES, FeatureKind, Features, quantise_rootsift

DEFAULT_COUNT = 1000
# More detail than this does not help matching and costs time.
MAX_SIDE_PX = 800
THUMBNAIL_WIDTH_PX = 96
_EPSILON = 1e-7


def extract(
    image: NDArray[np.uint8], kind: FeatureKind | str = FeatureKind.ROOTSIFT, count: int = DEFAULT_COUNT
) -> Features:
    """The strongest `count` features of `image`, (H, W) grey or (H, W, 3) BGR uint8; coordinates in its own pixels.

    RootSIFT (Arandjelovic and Zisserman, CVPR 2012): SIFT, L1-normalised, square root. Images larger than
    `MAX_SIDE_PX` are shrunk first. An image without texture gives zero features.
    """
    cv2 = opencv()
    kind = FeatureKind(kind)
    grey, scale = _shrunk_grey(cv2, image)
    detector: Any = cv2.SIFT_create(count) if kind is FeatureKind.ROOTSIFT else cv2.ORB_create(count)
    keypoints, descriptors = detector.detectAndCompute(grey, None)
    if descriptors is None or not len(keypoints):
        empty = np.zeros((0, DESCRIPTOR_BYTES[kind]), np.uint8)
        return Features(kind, np.zeros((0, 2), np.float32), empty)
    # SIFT may return a few more than asked for where responses tie.
    strongest = np.argsort([-point.response for point in keypoints], kind="stable")[:count]
    points = np.array([keypoints[i].pt for i in strongest], np.float32)
    # Pixel centres are at integers: shrinking maps x to (x + .5) s - .5.
    points = ((points + 0.5) / scale - 0.5).astype(np.float32)
    high = np.array([image.shape[1], image.shape[0]], np.float32) - 0.5
    points = np.clip(points, -0.5, np.nextafter(high, np.float32(0)))
    chosen = descriptors[strongest]
    return Features(kind, points, root_sift(chosen) if kind is FeatureKind.ROOTSIFT else chosen)


def root_sift(sift: NDArray[np.float32]) -> NDArray[np.uint8]:
    """RootSIFT bytes (n, 128) of SIFT descriptors (n, 128)."""
    total = np.abs(sift).sum(axis=1, keepdims=True)
    return quantise_rootsift(np.sqrt(sift / np.maximum(total, _EPSILON)))


def thumbnail(image: NDArray[np.uint8], width: int = THUMBNAIL_WIDTH_PX) -> bytes:
    """A small grey JPEG of `image`, for the station to weigh surfaces with."""
    cv2 = opencv()
    grey = _grey(cv2, image)
    height = max(1, round(grey.shape[0] * width / grey.shape[1]))
    small = cv2.resize(grey, (width, height), interpolation=cv2.INTER_AREA)
    return encode_jpeg(small, quality=80)


def encode_jpeg(image: NDArray[np.uint8], quality: int = 85) -> bytes:
    """JPEG bytes of an image, (H, W) grey or (H, W, 3) BGR uint8."""
    cv2 = opencv()
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise ValueError(f"OpenCV cannot encode an image of shape {image.shape} and type {image.dtype}")
    return bytes(data)


def decode_image(data: bytes) -> NDArray[np.uint8]:
    """The picture, (H, W, 3) BGR uint8, in JPEG, PNG or WebP bytes, as the sensor took it.

    Raises ValueError where there is none.
    """
    cv2 = opencv()
    buffer = np.frombuffer(data, np.uint8)
    # Turned by its orientation tag a picture would no longer be the camera's.
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    image: NDArray[np.uint8] | None = cv2.imdecode(buffer, flags) if len(buffer) else None
    if image is None:
        raise ValueError(f"image: {len(data)} bytes that OpenCV cannot decode")
    return image


def opencv() -> ModuleType:
    """OpenCV, or MissingExtraError where it is not installed."""
    try:
        import cv2
    except ImportError as error:
        raise MissingExtraError("extracting features or encoding pictures", "vision") from error
    return cv2


def _grey(cv2: ModuleType, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    grey: NDArray[np.uint8] = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return grey


def _shrunk_grey(cv2: ModuleType, image: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Grey image of at most MAX_SIDE_PX, and the factors (x, y) that it was shrunk by."""
    grey = _grey(cv2, image)
    height, width = grey.shape
    largest = max(height, width)
    if largest <= MAX_SIDE_PX:
        return grey, np.ones(2)
    size = (max(1, round(width * MAX_SIDE_PX / largest)), max(1, round(height * MAX_SIDE_PX / largest)))
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    return small, np.array([size[0] / width, size[1] / height])
