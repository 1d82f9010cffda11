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
    whole = _is_whole(data)
    if whole is None:
        raise DecodeError(BAD_IMAGE, field, f"{len(data)} bytes that are not a JPEG, PNG or WebP picture")
    try:
        width, height = imagesize.get(BytesIO(data), exif_rotation=False)
    except ValueError as error:
        raise DecodeError(BAD_IMAGE, field, f"unreadable head: {error}") from error
    if width <= 0 or height <= 0:
        raise DecodeError(BAD_IMAGE, field, "a head without a size")
    if width * height > most_pixels:
        raise DecodeError(
            IMAGE_TOO_LARGE, field, f"{width} x {height} px claimed, more than {most_pixels / 1e6:g} megapixels"
        )
    if not whole:
        raise DecodeError(BAD_IMAGE, field, f"truncated after {len(data)} bytes")
    return width, height


def _is_whole(data: bytes) -> bool | None:
    """Whether the picture's end is there; None if it is of no known format. Decoders fill up what is missing."""
    if data.startswith(_JPEG):
        scan = _scan(data)
        return scan is not None and data.find(_JPEG_END, scan) >= 0
    if data.startswith(_PNG):
        return _PNG_END in data[-64:]
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return len(data) >= 8 + int.from_bytes(data[4:8], "little")
    return None


def _scan(data: bytes) -> int | None:
    """Where a JPEG's coded pictures begin, past the segments (one of which may hold a thumbnail with an end)."""
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF:
        if data[at + 1] == _START_OF_SCAN:
            return at
        filler = data[at + 1] == 0xFF
        at += 1 if filler else 2 + int.from_bytes(data[at + 2 : at + 4])
    return None
