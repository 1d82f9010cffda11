"""Who is near whom: boxes in the world by name, found by the places they lie in."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import TypeVar

from covista_service.perception.extent import Box

# Boxes smaller than 2^-10 m lie in cells of that size.
_FINEST = -10
# Of so many levels of cells one is a rung, on which all smaller boxes lie too.
_RUNG = 2
Cell = tuple[int, int, int, int]
_Place = TypeVar("_Place", int, Cell)


class Grid:
    """Boxes on cubic cells, each on the level where cells are as wide as the box or up to twice as wide.

    So a box lies in at most eight cells of its level, whatever its size, and in at most eight of each second level
    above it, up to what is larger than any box so far. Who asks for what meets a box looks into the cells that it
    covers on levels no finer than its own, and for all that is smaller into those on one: none of it follows how many
    boxes there are elsewhere. Boxes that are endless are held against everything.
    """

    def __init__(self) -> None:
        self._boxes: dict[str, Box] = {}
        self._levels: dict[int, dict[str, None]] = {}
        self._cells: dict[Cell, dict[str, None]] = {}
        # By cells of a rung, what is smaller; and the highest rung.
        self._smaller: dict[Cell, dict[str, None]] = {}
        self._top: int | None = None
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
        self._raise(level)
        self._levels.setdefault(level, {})[name] = None
        for cell in _cells(box, level):
            self._cells.setdefault(cell, {})[name] = None
        self._climb(name, box, level)

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
        for rung in self._rungs(level):
            for cell in _cells(box, rung):
                _drop(self._smaller, cell, name)

    def meeting(self, box: Box) -> list[str]:
        """Names of all whose boxes touch this one, in the order in which they lie here."""
        size = _level(box)
        if size is None or self._top is None:
            found = dict.fromkeys(self._boxes)
        else:
            rung = min(_RUNG * (size // _RUNG), self._top)
            found = self._endless | self._below(rung, box)
            for level, names in self._levels.items():
                if level >= rung:
                    found |= self._on(level, names, box)
        return [name for name in found if _touch(self._boxes[name], box)]

    def _rungs(self, level: int, above: int = _FINEST - _RUNG) -> range:
        """Rungs that are higher than a level, and than another rung."""
        top = above if self._top is None else self._top
        return range(max(_RUNG * (level // _RUNG), above) + _RUNG, top + 1, _RUNG)

    def _climb(self, name: str, box: Box, level: int, above: int = _FINEST - _RUNG) -> None:
        for rung in self._rungs(level, above):
            for cell in _cells(box, rung):
                self._smaller.setdefault(cell, {})[name] = None

    def _raise(self, level: int) -> None:
        """Let the highest rung be above this level: a few times in the life of a swarm."""
        top, self._top = self._top, max(_RUNG * (level // _RUNG + 1), _FINEST if self._top is None else self._top)
        if top is not None and top < self._top:
            for size, names in self._levels.items():
                for name in names:
                    self._climb(name, self._boxes[name], size, top)

    def _below(self, rung: int, box: Box) -> dict[str, None]:
        """What may touch a box of all that is smaller than a rung's cells."""
        if _count(box, rung) > len(self._boxes):
            return {name: None for level, names in self._levels.items() if level < rung for name in names}
        found: dict[str, None] = {}
        for cell in _cells(box, rung):
            found |= self._smaller.get(cell, {})
        return found

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
