"""What pairs of keyframes say of each other, for as long as one of them is in use."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from covista_service.perception.scene import Evidence
from covista_service.station.events import KeyframeId

Names = tuple[KeyframeId, KeyframeId]
_NONE: Mapping[Names, None] = {}


class Testimony:
    """Evidence by pair of keyframes, and by keyframe, in order of arrival."""

    def __init__(self) -> None:
        self._evidence: dict[Names, Evidence] = {}
        self._names: dict[KeyframeId, dict[Names, None]] = {}

    def __contains__(self, names: object) -> bool:
        return names in self._evidence

    def __getitem__(self, names: Names) -> Evidence:
        return self._evidence[names]

    def put(self, names: Names, said: Evidence) -> None:
        """Enter what a pair says, in the place of what it said before."""
        self._evidence[names] = said
        for name in names:
            self._names.setdefault(name, {})[names] = None

    def drop(self, names: Names) -> None:
        """Forget what a pair says."""
        del self._evidence[names]
        for name in names:
            beside = self._names[name]
            beside.pop(names)
            if not beside:
                del self._names[name]

    def of(self, *keyframes: KeyframeId) -> list[Names]:
        """Pairs that these keyframes take part in, each once, the oldest of each keyframe first."""
        return list(dict.fromkeys(names for keyframe in keyframes for names in self._names.get(keyframe, _NONE)))

    def beside(self, keyframe: KeyframeId) -> Iterator[tuple[KeyframeId, Evidence]]:
        """The other keyframes that there is evidence with, the newest first."""
        for names in reversed(self.of(keyframe)):
            yield names[1 - names.index(keyframe)], self._evidence[names]


def contradicts(said: Evidence) -> bool:
    """Do images contradict what was reported, in a way that no surface has been built with yet?"""
    return said.observed is None and said.link is not None and said.link.contradicts


def matched(
    keyframes: Iterable[KeyframeId], evidence: Mapping[tuple[int, int], Evidence]
) -> dict[int, dict[KeyframeId, int]]:
    """For each keyframe of a job by index, those that it shares points with, and how many."""
    names = tuple(keyframes)
    shared: dict[int, dict[KeyframeId, int]] = {}
    for (i, j), said in evidence.items():
        if said.matched:
            shared.setdefault(i, {})[names[j]] = said.matched
            shared.setdefault(j, {})[names[i]] = said.matched
    return shared
