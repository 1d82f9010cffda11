"""Whom the others bear out, where images contradict what two robots have reported."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Set as AbstractSet

import numpy as np

from covista_service.perception.scales import parts_of
from covista_service.station.events import KeyframeId

Names = tuple[KeyframeId, KeyframeId]


class Agreements:
    """Which robots' reported poses the images of which others bear out."""

    def __init__(self) -> None:
        self._agree: dict[tuple[str, str], tuple[Names, bool]] = {}

    def note(self, first: KeyframeId, second: KeyframeId, *, agree: bool) -> None:
        """Enter whether the images of two robots agree with what the two have reported."""
        self._agree[first.robot, second.robot] = ((first, second), agree)

    def borne_out(self, held: Callable[[KeyframeId], bool]) -> AbstractSet[str]:
        """The largest set of robots that are connected by agreement: who contradicts them is taken to be wrong.

        Nobody where no set is larger than all others. Only keyframes that are still `held` bear witness: a robot that
        was right long ago may have lost its way.
        """
        said = {pair: agree for pair, (names, agree) in self._agree.items() if all(map(held, names))}
        names = sorted({name for pair in said for name in pair})
        index = {name: k for k, name in enumerate(names)}
        parts = parts_of(len(names), [(index[a], index[b]) for (a, b), agree in said.items() if agree])
        if not len(parts):
            return frozenset()
        sizes = np.bincount(parts)
        largest = int(sizes.argmax())
        if (sizes == sizes[largest]).sum() > 1:
            return frozenset()
        return frozenset(name for name, part in zip(names, parts.tolist(), strict=True) if part == largest)

    def forget(self, robot: str) -> None:
        """Drop a robot."""
        self._agree = {pair: said for pair, said in self._agree.items() if robot not in pair}
