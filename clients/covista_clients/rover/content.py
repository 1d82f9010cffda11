"""What a keyframe carries: checked at once, in the caller's thread, and encoded later, in the rover's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

import numpy as np
from covista_schemas import features
from covista_schemas.messages import MAX_THUMBNAIL_BYTES, Camera, Features, check_inside
from covista_schemas.zenoh_config import MAX_MESSAGE_BYTES
from numpy.typing import NDArray

# What a keyframe holds beside its image: ids, camera, pose, covariance.
_ROOM_BYTES = 4096
MAX_IMAGE_BYTES = MAX_MESSAGE_BYTES - _ROOM_BYTES
_QUALITIES = (85, 70, 50, 30)
_JPEG, _PNG = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"

Image = NDArray[np.uint8] | bytes | Features


class Send(StrEnum):
    """What a rover makes of its pictures before they go out."""

    IMAGE = "image"
    FEATURES = "features"
    FEATURES_AND_THUMBNAIL = "features+thumbnail"


@dataclass(frozen=True, slots=True, eq=False)
class Content:
    """The content of a keyframe as it goes out: an encoded image, or features."""

    image: bytes | None = None
    features: Features | None = None
    thumbnail: bytes | None = None


def prepare(image: Image, camera: Camera, send: Send, thumbnail: bytes | None = None) -> Callable[[], Content]:
    """Check what the caller gave, and return the work that is left.

    Raises ValueError that names what does not fit, and MissingExtraError where the work needs OpenCV.
    """
    if isinstance(image, Features):
        return partial(Content, None, _checked_features(image, camera), _checked_thumbnail(thumbnail))
    if thumbnail is not None:
        raise ValueError("thumbnail: goes with Features only; Rover(send='features+thumbnail') makes one of a picture")
    if isinstance(image, np.ndarray):
        features.opencv()
        # The caller may use the array for the next picture at once.
        return partial(_encode, _checked_array(image, camera).copy(), send)
    data = _checked_bytes(image)
    if send is Send.IMAGE:
        return partial(Content, data)
    features.opencv()
    return partial(_encode_decoded, data, camera, send)


def _checked_features(given: Features, camera: Camera) -> Features:
    checked = Features.from_arrays(given.kind, given.keypoints_px, given.descriptors)
    check_inside(checked.keypoints_px, camera)
    return checked


def _checked_thumbnail(thumbnail: bytes | None) -> bytes | None:
    if thumbnail is not None and not (thumbnail.startswith(_JPEG) and len(thumbnail) <= MAX_THUMBNAIL_BYTES):
        raise ValueError(f"thumbnail: {len(thumbnail)} bytes, not a JPEG of at most {MAX_THUMBNAIL_BYTES}")
    return thumbnail


def _checked_array(image: NDArray[np.uint8], camera: Camera) -> NDArray[np.uint8]:
    sizes = {(camera.height, camera.width), (camera.height, camera.width, 3)}
    if image.shape not in sizes or image.dtype != np.uint8:
        wanted = f"({camera.height}, {camera.width}) or ({camera.height}, {camera.width}, 3) uint8"
        raise ValueError(f"image: shape {image.shape} {image.dtype}, but the camera takes {wanted}")
    return image


def _checked_bytes(image: bytes) -> bytes:
    if not isinstance(image, bytes | bytearray | memoryview):
        raise ValueError(f"image: an array, encoded bytes, or Features, not {type(image).__name__}")
    data = bytes(image)
    if not (data.startswith((_JPEG, _PNG)) or (data[:4] == b"RIFF" and data[8:12] == b"WEBP")):
        raise ValueError("image: bytes that are neither JPEG, PNG nor WebP")
    if len(data) > MAX_IMAGE_BYTES:
        raise ValueError(f"image: {len(data)} bytes, more than {MAX_IMAGE_BYTES}")
    return data


def _encode(image: NDArray[np.uint8], send: Send) -> Content:
    match send:
        case Send.IMAGE:
            return Content(image=_jpeg(image))
        case Send.FEATURES:
            return Content(features=features.extract(image))
        case Send.FEATURES_AND_THUMBNAIL:
            return Content(features=features.extract(image), thumbnail=features.thumbnail(image))


def _jpeg(image: NDArray[np.uint8]) -> bytes:
    """JPEG of the best quality that fits into one message."""
    for quality in _QUALITIES:
        data = features.encode_jpeg(image, quality)
        if len(data) <= MAX_IMAGE_BYTES:
            return data
    raise ValueError(f"image: {len(data)} bytes even as a poor JPEG, more than {MAX_IMAGE_BYTES}")


def _encode_decoded(data: bytes, camera: Camera, send: Send) -> Content:
    return _encode(_checked_array(features.decode_image(data), camera), send)
