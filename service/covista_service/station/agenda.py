"""Which pair to survey next, so that every robot gets its turn whatever the others do."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from heapq import heappop, heappush
from itertools import combinations

from covista_service.station.events import Keyframe, KeyframeId, Pair
from covista_service.station.options import StationOptions, nanoseconds
from covista_service.station.pairs import Pairs, pair_of
from covista_service.station.roster import Roster

_SWEEP_STEP = 64
_SWEEP_EVERY = 8
_MOTION_EVERY = 4


class Agenda:
    """Pairs in four queues, taken in turns so that none can starve another.

    *Fresh*: keyframes that no survey has seen yet, in order of arrival, each with its most promising partner.
    *Regular*: pairs whose views may meet and that have a new keyframe, the one tried longest ago first.
    *Moved*: a robot's new keyframe and an earlier one of its own, whose parallax tells depths.
    *Sweep*: all other pairs with a new keyframe, a few at a time, each tried once in a while.
    """

    def __init__(self, roster: Roster, pairs: Pairs, options: StationOptions) -> None:
        self._roster = roster
        self._pairs = pairs
        self._capacity = options.capacity
        self._retry_after_ns = nanoseconds(options.retry_after_s)
        self._in_flight: dict[Pair, tuple[Keyframe, Keyframe]] = {}
        self._partners: defaultdict[str, set[str]] = defaultdict(set)
        self._tried_ns: dict[Pair, int] = {}
        self._fresh: dict[str, None] = {}
        self._moved: dict[str, Keyframe] = {}
        self._regular: list[tuple[int, Pair]] = []
        self._queued: set[Pair] = set()
        self._sweep: Iterator[Pair] = iter(())
        self._starts = 0

    def judge(self, pair: Pair, *, plausible: bool) -> None:
        """Enter whether a pair's views may meet, as of its newest keyframes."""
        a, b = pair
        if plausible:
            self._partners[a].add(b)
            self._partners[b].add(a)
            self._enqueue(pair)
        else:
            self._partners[a].discard(b)
            self._partners[b].discard(a)

    def fresh(self, robot: str) -> None:
        """A robot has a keyframe that no survey has seen; one that waits already keeps its place."""
        self._fresh.setdefault(robot)

    def moved(self, robot: str, earlier: Keyframe | None) -> None:
        """Hold a robot's new keyframe against an earlier one of its own; None if that would tell nothing."""
        self._moved.pop(robot, None)
        if earlier is not None:
            self._moved[robot] = earlier

    def partners(self, robot: str) -> AbstractSet[str]:
        """Robots whose views may meet this one's."""
        return self._partners.get(robot, frozenset())

    @property
    def under_way_count(self) -> int:
        """How many surveys are under way."""
        return len(self._in_flight)

    def start(self, now_ns: int) -> tuple[Keyframe, Keyframe] | None:
        """The next pair of keyframes to survey, under way from now on; None if nothing is due or all hands are full."""
        if len(self._in_flight) >= self._capacity:
            return None
        queues = [self._next_fresh, self._next_regular]
        if self._starts % 2:
            queues.reverse()
        queues.insert(0 if self._starts % _SWEEP_EVERY == _SWEEP_EVERY - 1 else 2, lambda: self._next_swept(now_ns))
        queues.insert(0 if self._starts % _MOTION_EVERY == _MOTION_EVERY - 1 else 2, self._next_moved)
        pair = next((found for queue in queues if (found := queue()) is not None), None)
        return None if pair is None else self._start(pair, now_ns)

    def done(self, first: KeyframeId, second: KeyframeId) -> tuple[Keyframe, Keyframe] | None:
        """A survey is over; the keyframes it was about, None if it was not under way."""
        pair = (first.robot, second.robot)
        keyframes = self._in_flight.get(pair)
        if keyframes is None or (keyframes[0].id, keyframes[1].id) != (first, second):
            return None
        return self._in_flight.pop(pair)

    def again(self, pair: Pair) -> None:
        """Put a pair back in the queue if one of its keyframes is newer than its last survey."""
        if pair[1] in self.partners(pair[0]):
            self._enqueue(pair)

    def under_way(self, name: KeyframeId) -> bool:
        """Is a survey of this keyframe under way?"""
        return any(name == keyframe.id for keyframes in self._in_flight.values() for keyframe in keyframes)

    def forget(self, robot: str) -> None:
        """Take a robot off; what comes of its surveys under way is of no interest any more."""
        for partner in self._partners.pop(robot, set()):
            self._partners[partner].discard(robot)
        self._fresh.pop(robot, None)
        self._moved.pop(robot, None)
        for pair in [pair for pair in self._tried_ns if robot in pair]:
            del self._tried_ns[pair]
        for pair in [pair for pair in self._in_flight if robot in pair]:
            del self._in_flight[pair]

    def _start(self, pair: Pair, now_ns: int) -> tuple[Keyframe, Keyframe]:
        keyframes = self._keyframes(pair)
        # Every queue offers pairs that are due, and those have both keyframes.
        assert keyframes is not None  # noqa: S101 - tells the type checker what `_due` has found
        self._in_flight[pair] = keyframes
        self._starts += 1
        if pair[0] == pair[1]:
            del self._moved[pair[0]]
            return keyframes
        self._tried_ns[pair] = now_ns
        for robot in pair:
            self._fresh.pop(robot, None)
        return keyframes

    def _keyframes(self, pair: Pair) -> tuple[Keyframe, Keyframe] | None:
        first, second = self._roster.get(pair[0]), self._roster.get(pair[1])
        if first is None or second is None or first.keyframe is None or second.keyframe is None:
            return None
        if first is second:
            earlier = self._moved.get(pair[0])
            return None if earlier is None else (earlier, first.keyframe)
        return first.keyframe, second.keyframe

    def _due(self, pair: Pair) -> bool:
        keyframes = self._keyframes(pair)
        if keyframes is None or pair in self._in_flight:
            return False
        return self._pairs[pair].surveyed != (keyframes[0].id, keyframes[1].id)

    def _enqueue(self, pair: Pair) -> None:
        if pair not in self._queued and self._due(pair):
            self._queued.add(pair)
            heappush(self._regular, (self._tried_ns.get(pair, 0), pair))

    def _next_fresh(self) -> Pair | None:
        for robot in list(self._fresh):
            due = [pair for pair in (pair_of(robot, other) for other in self.partners(robot)) if self._due(pair)]
            if due:
                return min(due, key=self._promise)
            if not self.partners(robot):
                del self._fresh[robot]
        return None

    def _next_moved(self) -> Pair | None:
        return next(((robot, robot) for robot in self._moved if (robot, robot) not in self._in_flight), None)

    def _promise(self, pair: Pair) -> tuple[float, int, Pair]:
        overlaps = self._pairs.overlaps(pair)
        return -sum(overlaps or (0.0,)), self._tried_ns.get(pair, 0), pair

    def _next_regular(self) -> Pair | None:
        while self._regular:
            tried_ns, pair = heappop(self._regular)
            self._queued.discard(pair)
            if tried_ns != self._tried_ns.get(pair, 0):
                # Another queue has given it a turn meanwhile.
                self._enqueue(pair)
            elif pair[1] in self.partners(pair[0]) and self._due(pair):
                return pair
        return None

    def _next_swept(self, now_ns: int) -> Pair | None:
        for _ in range(_SWEEP_STEP):
            pair = next(self._sweep, None)
            if pair is None:
                names = sorted(robot.id for robot in self._roster if robot.keyframe is not None)
                self._sweep = combinations(names, 2)
                return None
            if now_ns - self._tried_ns.get(pair, -self._retry_after_ns) >= self._retry_after_ns and self._due(pair):
                return pair
        return None
