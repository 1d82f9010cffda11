"""Places between two entries of the history, as opaque words that a page names the next one by."""

from __future__ import annotations

import struct
from base64 import urlsafe_b64decode, urlsafe_b64encode

from covista_service.answers.past import CursorError

# Time in microseconds and key of the last entry that was given.
Place = tuple[int, int]
_FORM = struct.Struct(">qq")
_LONGEST = 64


def cursor_of(place: Place) -> str:
    """The word for a place."""
    return urlsafe_b64encode(_FORM.pack(*place)).decode().rstrip("=")


def place_of(cursor: str) -> Place:
    """The place that a word is for. Raises CursorError."""
    try:
        if len(cursor) > _LONGEST:
            raise ValueError("too long")
        packed = urlsafe_b64decode(cursor.encode("ascii") + b"=" * (-len(cursor) % 4))
        time_us, key = _FORM.unpack(packed)
    except (ValueError, struct.error) as error:
        raise CursorError(f"{cursor[:80]!r} is no cursor of the history: take `next` of a page") from error
    if cursor_of((time_us, key)) != cursor:
        raise CursorError(f"{cursor[:80]!r} is no cursor of the history: take `next` of a page")
    return time_us, key
