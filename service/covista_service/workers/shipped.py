"""Which features have been shipped, and where they are."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar
from weakref import ref

from covista_service.perception.camera import Features

_Place = TypeVar("_Place")


class Shipped(Generic[_Place]):
    """Places of features that have been shipped, for as long as the station holds them.

    The features of a keyframe are one object that all its jobs share. When it goes, its place comes out of `released`:
    so memory elsewhere is bounded by what the station holds itself. Not for several threads at once.
    """

    def __init__(self) -> None:
        self._held: dict[int, tuple[ref[Features], _Place]] = {}
        # Written when an object goes, in whichever thread that is.
        self._gone: deque[int] = deque()
        self._released: list[_Place] = []

    def __len__(self) -> int:
        self._bury()
        return len(self._held)

    def find(self, features: Features) -> _Place | None:
        """Where they are, None if nowhere."""
        self._bury()
        held = self._held.get(id(features))
        return None if held is None else held[1]

    def add(self, features: Features, place: _Place) -> None:
        """They are there now, and in no former place."""
        self._bury()
        name = id(features)
        former = self._held.pop(name, None)
        if former is not None:
            self._released.append(former[1])
        self._held[name] = ref(features, lambda _: self._gone.append(name)), place

    def released(self) -> list[_Place]:
        """Places, each told once, of features that nobody uses any more."""
        self._bury()
        released, self._released = self._released, []
        return released

    def _bury(self) -> None:
        while self._gone:
            _, place = self._held.pop(self._gone.popleft())
            self._released.append(place)
