"""Which answers have grown too old, though they need not come in order of their age."""

from __future__ import annotations

from heapq import heappop, heappush

from covista_service.station.events import Pair
from covista_service.station.options import NS_PER_S


class Ages:
    """Pairs by the second that their answers are of: putting one in and taking one out cost the same at any number."""

    def __init__(self) -> None:
        self._of_second: dict[int, dict[Pair, int]] = {}
        self._seconds: list[int] = []

    def put(self, pair: Pair, computed_ns: int) -> None:
        """Note when a pair's answer was computed."""
        second = computed_ns // NS_PER_S
        if second not in self._of_second:
            self._of_second[second] = {}
            heappush(self._seconds, second)
        self._of_second[second][pair] = computed_ns

    def drop(self, pair: Pair, computed_ns: int) -> None:
        """A pair's answer of that time stands no longer."""
        second = computed_ns // NS_PER_S
        pairs = self._of_second.get(second)
        if pairs is not None and pairs.pop(pair, None) is not None and not pairs:
            # A dict does not shrink when it is emptied, and there is one for each second until answers are too old.
            self._of_second[second] = {}

    def take(self, until_ns: int) -> list[Pair]:
        """Pairs whose answers were computed until then, the oldest second first; they are noted no longer."""
        taken: list[Pair] = []
        while self._seconds and self._seconds[0] * NS_PER_S <= until_ns:
            pairs = self._of_second[self._seconds[0]]
            old = [pair for pair, computed_ns in pairs.items() if computed_ns <= until_ns]
            for pair in old:
                del pairs[pair]
            taken += old
            if (self._seconds[0] + 1) * NS_PER_S > until_ns:
                break
            del self._of_second[heappop(self._seconds)]
        return taken
