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
# OpenCV's pyramids end with an error below.
MIN_SIDE_PX = 16
THUMBNAIL_WIDTH_PX = 96
_EPSILON = 1e-7
# Features are chosen from so many times their number; weak ones of ORB are seldom found again. One suppresses another
# if its response is so much less.
_CANDIDATES = {FeatureKind.ROOTSIFT: 2, FeatureKind.ORB: 1}
_SUPPRESSION = 0.9
# Distances between points are taken so many rows at a time, to bound memory.
_BLOCK = 512
_ORB_SCALE = 1.2


def extract(
    image: NDArray[np.uint8], kind: FeatureKind | str = FeatureKind.ROOTSIFT, count: int = DEFAULT_COUNT
) -> Features:
    """Strong features of `image`, (H, W) grey or (H, W, 3) BGR uint8; coordinates in its own pixels.

    At most `count`; RootSIFT's are chosen from twice as many by `spread`. RootSIFT (Arandjelovic and Zisserman, CVPR
    2012): SIFT, L1-normalised, square root. Images larger than `MAX_SIDE_PX` are shrunk first. An image without texture
    gives zero features. Raises ValueError for other arrays.
    """
    cv2 = opencv()
    kind = FeatureKind(kind)
    grey, shrunk_by = _shrunk_grey(cv2, image)
    large_enough = min(grey.shape) >= MIN_SIDE_PX
    keypoints, descriptors = (
        _detector(cv2, kind, _CANDIDATES[kind] * count).detectAndCompute(grey, None) if large_enough else ((), None)
    )
    if descriptors is None:
        return Features(kind, np.zeros((0, 2), np.float32), np.zeros((0, DESCRIPTOR_BYTES[kind]), np.uint8))
    points = np.array([point.pt for point in keypoints], np.float64)
    strongest = spread(points, np.array([point.response for point in keypoints]), count)
    points = points[strongest]
    if kind is FeatureKind.ORB:
        points = _centred(points, np.array([keypoints[i].octave for i in strongest]), grey)
    # Pixel centres are at integers: shrinking maps x to (x + .5) s - .5.
    points = (points + 0.5) / shrunk_by - 0.5
    high = np.array([image.shape[1], image.shape[0]]) - 0.5
    points_px = np.clip(points, -0.5, high).astype(np.float32)
    chosen = descriptors[strongest]
    return Features(kind, points_px, root_sift(chosen) if kind is FeatureKind.ROOTSIFT else chosen)


def spread(points_px: NDArray[np.float64], responses: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    """The `count` of n points (n, 2) that are the strongest over the widest neighbourhood, widest first.

    Adaptive non-maximal suppression (Brown, Szeliski and Winder, CVPR 2005): where texture is strong, as many points
    again tell nothing new, and surfaces need some everywhere. Points of one place suppress each other in no way.
    """
    order = np.argsort(-responses, kind="stable")
    if len(order) <= count:
        return order
    points = (points_px[order] - points_px.mean(axis=0)).astype(np.float32)
    # The first so many in this order are stronger than a point, by more than chance.
    stronger = np.searchsorted(-responses[order], -responses[order] / _SUPPRESSION)
    widths = np.full(len(points), np.inf, np.float32)
    for block in np.array_split(np.arange(len(points)), len(points) // _BLOCK + 1):
        rivals = points[: stronger[block].max(initial=0)]
        squares = np.einsum("ij,ij->i", rivals, rivals) - 2 * points[block] @ rivals.T
        squares[np.arange(len(rivals)) >= stronger[block, None]] = np.inf
        widths[block] = squares.min(axis=1, initial=np.inf) + np.einsum("ij,ij->i", points[block], points[block])
    return order[np.argsort(-widths, kind="stable")[:count]]


def _detector(cv2: ModuleType, kind: FeatureKind, count: int) -> Any:
    if kind is FeatureKind.ORB:
        return cv2.ORB_create(count, scaleFactor=_ORB_SCALE)
    # Without it SIFT's first enlargement moves every point by a quarter of a pixel.
    return cv2.SIFT_create(count, enable_precise_upscale=True)


def _centred(points: NDArray[np.float64], octaves: NDArray[np.intp], grey: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Points (n, 2) px of ORB, which multiplies by the scale of a level as if pixel corners were at integers."""
    size = np.array([grey.shape[1], grey.shape[0]])
    scale = _ORB_SCALE ** octaves[:, None]
    centred: NDArray[np.float64] = (points / scale + 0.5) * size / np.rint(size / scale) - 0.5
    return centred


def root_sift(sift: NDArray[np.float32]) -> NDArray[np.uint8]:
    """RootSIFT bytes (n, 128) of SIFT descriptors (n, 128)."""
    total = np.abs(sift).sum(axis=1, keepdims=True)
    return quantise_rootsift(np.sqrt(sift / np.maximum(total, _EPSILON)))


def thumbnail(image: NDArray[np.uint8], width: int = THUMBNAIL_WIDTH_PX) -> bytes:
    """A grey JPEG of `image` at most `width` px wide, for the station to weigh surfaces with."""
    cv2 = opencv()
    grey = _grey(cv2, image)
    width = min(width, grey.shape[1])
    height = max(1, round(grey.shape[0] * width / grey.shape[1]))
    small = cv2.resize(grey, (width, height), interpolation=cv2.INTER_AREA)
    return encode_jpeg(small, quality=80)


def encode_jpeg(image: NDArray[np.uint8], quality: int = 85) -> bytes:
    """JPEG bytes of an image, (H, W) grey or (H, W, 3) BGR uint8."""
    cv2 = opencv()
    _, data = cv2.imencode(".jpg", _checked(image), [cv2.IMWRITE_JPEG_QUALITY, quality])
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


def _checked(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    colours = image.shape[2:]
    if image.dtype != np.uint8 or image.ndim < 2 or colours not in ((), (3,)) or not image.size:
        raise ValueError(f"image: shape {image.shape} {image.dtype}, not (H, W) or (H, W, 3) uint8")
    return image


def _grey(cv2: ModuleType, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    grey: NDArray[np.uint8] = image if _checked(image).ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
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
