"""Who is near whom: boxes in the world by name, found by the places they lie in."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import TypeVar

from covista_service.perception.extent import Box

# Boxes smaller than 2^-10 m lie in cells of that size.
_FINEST = -10
Cell = tuple[int, int, int, int]
_Place = TypeVar("_Place", int, Cell)


class Grid:
    """Boxes on cubic cells, each on the level where cells are as wide as the box or up to twice as wide.

    So a box lies in at most eight cells, whatever its size, and who asks for what meets a box looks into the cells that
    it covers on every level in use. Boxes that are endless are held against everything.
    """

    def __init__(self) -> None:
        self._boxes: dict[str, Box] = {}
        self._levels: dict[int, dict[str, None]] = {}
        self._cells: dict[Cell, dict[str, None]] = {}
        self._endless: dict[str, None] = {}

    def __len__(self) -> int:
        return len(self._boxes)

    def __contains__(self, name: object) -> bool:
        return name in self._boxes

    def put(self, name: str, box: Box) -> None:
        """Set a box; the one held under this name goes."""
        self.remove(name)
        self._boxes[name] = box
        level = _level(box)
        if level is None:
            self._endless[name] = None
            return
        self._levels.setdefault(level, {})[name] = None
        for cell in _cells(box, level):
            self._cells.setdefault(cell, {})[name] = None

    def remove(self, name: str) -> None:
        """Take a box out, if it is there."""
        box = self._boxes.pop(name, None)
        if box is None:
            return
        level = _level(box)
        if level is None:
            del self._endless[name]
            return
        _drop(self._levels, level, name)
        for cell in _cells(box, level):
            _drop(self._cells, cell, name)

    def meeting(self, box: Box) -> list[str]:
        """Names of all whose boxes touch this one, in the order in which they lie here."""
        if _level(box) is None:
            found = dict.fromkeys(self._boxes)
        else:
            found = dict.fromkeys(self._endless)
            for level, names in self._levels.items():
                found |= self._on(level, names, box)
        return [name for name in found if _touch(self._boxes[name], box)]

    def _on(self, level: int, names: dict[str, None], box: Box) -> dict[str, None]:
        """Who may touch a box on one level: by its cells, or all where those are more than there are boxes."""
        if _count(box, level) > len(names):
            return names
        found: dict[str, None] = {}
        for cell in _cells(box, level):
            found |= self._cells.get(cell, {})
        return found


def _level(box: Box) -> int | None:
    """The exponent of the width of its cells, None for what is endless."""
    width = max(high - low for low, high in zip(*box, strict=True))
    return max(_FINEST, math.frexp(width)[1]) if math.isfinite(width) else None


def _spans(box: Box, level: int) -> list[range]:
    width = math.ldexp(1.0, level)
    return [range(math.floor(low / width), math.floor(high / width) + 1) for low, high in zip(*box, strict=True)]


def _count(box: Box, level: int) -> int:
    return math.prod(map(len, _spans(box, level)))


def _cells(box: Box, level: int) -> Iterator[Cell]:
    return ((level, x, y, z) for x, y, z in product(*_spans(box, level)))


def _touch(one: Box, other: Box) -> bool:
    (a, b, c), (d, e, f) = one
    (g, h, i), (j, k, m) = other
    return a <= j and g <= d and b <= k and h <= e and c <= m and i <= f


def _drop(places: dict[_Place, dict[str, None]], place: _Place, name: str) -> None:
    held = places[place]
    del held[name]
    if not held:
        del places[place]
