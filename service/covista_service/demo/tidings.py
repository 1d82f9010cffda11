"""What the station's process tells the demo."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Ready:
    """The station listens: `url` of its API, end points of its zenoh link."""

    url: str
    link: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Failed:
    """The station could not start; one line for a person."""

    text: str
