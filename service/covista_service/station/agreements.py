"""Whom the others bear out, where images contradict what two robots have reported."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from collections.abc import Set as AbstractSet

import numpy as np

from covista_service.perception.scales import parts_of
from covista_service.station.events import KeyframeId

Names = tuple[KeyframeId, KeyframeId]
Held = Callable[[KeyframeId], bool]
# Only the nearest so many bear witness: who is farther away is not asked.
NEAREST = 64


class Agreements:
    """Which robots' reported poses the images of which others bear out."""

    def __init__(self) -> None:
        # What images say of two robots, by either.
        self._said: dict[str, dict[str, tuple[Names, bool]]] = {}

    def note(self, first: KeyframeId, second: KeyframeId, *, agree: bool) -> None:
        """Enter whether the images of two robots agree with what the two have reported."""
        for one, other in ((first, second), (second, first)):
            self._said.setdefault(one.robot, {})[other.robot] = ((first, second), agree)

    def borne_out(self, robots: Iterable[str], held: Held) -> AbstractSet[str]:
        """Which of these robots belong to the largest set around them that is connected by agreement.

        Who contradicts that set is taken to be wrong; nobody is borne out where no set is larger than all others. A
        robot's witnesses are those that images connect it with, whatever they say, the nearest first. Only keyframes
        that are still `held` bear witness: a robot that was right long ago may have lost its way. What others have said
        is forgotten as it is come across.
        """
        asked, borne_out = dict.fromkeys(robots), set[str]()
        while asked:
            around = self._around(next(iter(asked)), held)
            borne_out.update(self._largest(around, held) & asked.keys())
            for robot in around:
                asked.pop(robot, None)
        return borne_out

    def forget(self, robot: str) -> None:
        """Drop a robot."""
        for other in list(self._said.get(robot, ())):
            self._drop(robot, other)

    def _drop(self, *robots: str) -> None:
        for one, other in (robots, robots[::-1]):
            del self._said[one][other]
            if not self._said[one]:
                del self._said[one]

    def _around(self, robot: str, held: Held) -> list[str]:
        found, ahead = {robot: None}, deque([robot])
        while ahead:
            one = ahead.popleft()
            for other, (names, _) in list(self._said.get(one, {}).items()):
                if not all(map(held, names)):
                    self._drop(one, other)
                elif other not in found:
                    if len(found) == NEAREST:
                        return list(found)
                    found[other] = None
                    ahead.append(other)
        return list(found)

    def _largest(self, robots: list[str], held: Held) -> set[str]:
        index = {robot: k for k, robot in enumerate(robots)}
        agreeing = [
            (index[one], index[other])
            for one in robots
            for other, (names, agree) in self._said.get(one, {}).items()
            if agree and other in index and all(map(held, names))
        ]
        parts = parts_of(len(robots), agreeing)
        sizes = np.bincount(parts)
        largest = int(sizes.argmax())
        if (sizes == sizes[largest]).sum() > 1 or len(robots) == 1:
            return set()
        return {robot for robot, part in zip(robots, parts.tolist(), strict=True) if part == largest}
