"""What the head of an encoded picture says, before anything is decoded."""

from __future__ import annotations

from io import BytesIO

import imagesize
from covista_schemas.codec import BAD_IMAGE, IMAGE_TOO_LARGE
from covista_schemas.errors import DecodeError

MAX_PIXELS = 50_000_000
MAX_THUMBNAIL_PIXELS = 1_000_000

_JPEG, _JPEG_END = b"\xff\xd8\xff", b"\xff\xd9"
_PNG, _PNG_END = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"
_START_OF_SCAN = 0xDA
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
# Pictures have a few dozen; a million of them would hold up everybody else's messages for seconds.
_MAX_SEGMENTS = 1000


def check_image(data: bytes, width: int, height: int) -> None:
    """Refuse what is not a whole picture of this size. Raises DecodeError."""
    found = measure(data, "image", MAX_PIXELS)
    if found != (width, height):
        raise DecodeError(BAD_IMAGE, "image", f"{found[0]} x {found[1]} px, but the camera says {width} x {height}")


def check_thumbnail(data: bytes) -> None:
    """Refuse a thumbnail that is not a whole, small picture. Raises DecodeError."""
    measure(data, "features.thumbnail", MAX_THUMBNAIL_PIXELS)


def measure(data: bytes, field: str, most_pixels: int) -> tuple[int, int]:
    """Width and height of a whole JPEG, PNG or WebP picture of at most `most_pixels`. Raises DecodeError."""
    head = _read(data)
    if head is None:
        raise DecodeError(BAD_IMAGE, field, f"{len(data)} bytes that are not a JPEG, PNG or WebP picture")
    width, height, whole = head
    if width <= 0 or height <= 0:
        raise DecodeError(BAD_IMAGE, field, "a head without a size")
    if width * height > most_pixels:
        raise DecodeError(
            IMAGE_TOO_LARGE, field, f"{width} x {height} px claimed, more than {most_pixels / 1e6:g} megapixels"
        )
    if not whole:
        raise DecodeError(BAD_IMAGE, field, f"truncated after {len(data)} bytes")
    return width, height


def _read(data: bytes) -> tuple[int, int, bool] | None:
    """Width and height, not positive where there are none, and whether the picture's end is there.

    None for what is of no known format. Decoders fill up what is missing at the end.
    """
    if data.startswith(_JPEG):
        return _read_jpeg(data)
    if data.startswith(_PNG):
        whole = _PNG_END in data[-64:]
    elif data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        whole = len(data) >= 8 + int.from_bytes(data[4:8], "little")
    else:
        return None
    width, height = imagesize.get(BytesIO(data), exif_rotation=False)
    return width, height, whole


def _read_jpeg(data: bytes) -> tuple[int, int, bool]:
    """The size in the first frame's head; the end counts past all segments, of which one may hold a thumbnail."""
    width = height = 0
    at = 2
    for _ in range(_MAX_SEGMENTS):
        if at + 4 > len(data) or data[at] != 0xFF:
            break
        kind = data[at + 1]
        if kind == _START_OF_SCAN:
            return width, height, data.find(_JPEG_END, at) >= 0
        if kind in _FRAMES and not width:
            height, width = int.from_bytes(data[at + 5 : at + 7]), int.from_bytes(data[at + 7 : at + 9])
        # One more 0xFF is a filler.
        at += 1 if kind == 0xFF else 2 + int.from_bytes(data[at + 2 : at + 4])
    return width, height, False
