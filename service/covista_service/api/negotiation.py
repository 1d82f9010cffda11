"""Which representation of an answer a client wants (RFC 9110, Accept)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from covista_schemas.errors import CovistaError


class NotAcceptableError(CovistaError):
    """Nothing that there is fits what the client accepts; the text says what there is."""


def choose(accept: str | None, offered: Sequence[str]) -> str:
    """The media type that the client likes best; of those that he likes alike, the first. Raises NotAcceptableError."""
    ranges = list(_ranges(accept or "*/*"))
    best = max(offered, key=lambda each: _quality(each, ranges))
    if _quality(best, ranges) <= 0:
        raise NotAcceptableError(f"there is {', '.join(offered)}")
    return best


def _ranges(accept: str) -> Iterator[tuple[str, float]]:
    """Media ranges and how much each is liked; what cannot be read is liked no less for that."""
    for part in accept.split(","):
        name, *parameters = (each.strip().lower() for each in part.split(";"))
        quality = 1.0
        for parameter in parameters:
            key, _, value = parameter.partition("=")
            if key.strip() == "q":
                quality = _number(value.strip())
        if name:
            yield name, quality


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        return 1.0
    return value if 0 <= value <= 1 else 1.0


def _quality(media_type: str, ranges: Sequence[tuple[str, float]]) -> float:
    """As the most specific range says that it falls in; 0 where it falls in none."""
    for name in (media_type, f"{media_type.partition('/')[0]}/*", "*/*"):
        found = [quality for each, quality in ranges if each == name]
        if found:
            return max(found)
    return 0.0
