"""Which pair to survey next, so that every robot gets its turn whatever the others do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from collections.abc import Set as AbstractSet

from covista_service.perception.camera import Pose
from covista_service.perception.extent import change
from covista_service.station.events import Keyframe, KeyframeId, Pair
from covista_service.station.options import StationOptions, nanoseconds
from covista_service.station.pairs import Pairs, pair_of
from covista_service.station.patrol import Patrol
from covista_service.station.roster import Robot, Roster
from covista_service.station.waiting import UNSEEN, Plan, Waiting
from covista_service.station.workload import Workload

_QUEUES = ("fresh", "regular", "moved", "sweep")
# Whose turn it is, start by start; who has nothing leaves it to the others, in the order above.
_TURNS = ("fresh", "regular", "fresh", "moved", "fresh", "regular", "fresh", "sweep")
_NOBODY: Mapping[str, Plan] = {}
# How near a pair is to a boundary of groups, from 0 to 1.
Boundary = Callable[[Pair], float]


class Agenda:
    """Pairs in four queues, taken in turns so that none can starve another.

    *Fresh*: keyframes that no survey has seen yet, in order of arrival, each with its most promising partner.
    *Regular*: pairs whose views may meet and that have a new keyframe, by expected news: see `Waiting`.
    *Moved*: a robot's new keyframe and an earlier one of its own, whose parallax tells depths.
    *Sweep*: all other pairs with a new keyframe, a few at a time, each tried once in a while: see `Patrol`.

    What waits are pairs of robots, and their newest keyframes are surveyed: what is replaced meanwhile is counted as
    outdated and never begun.
    """

    def __init__(self, roster: Roster, pairs: Pairs, options: StationOptions, boundary: Boundary) -> None:
        self._roster = roster
        self._pairs = pairs
        self._boundary = boundary
        self.capacity = options.capacity
        self._in_flight: dict[Pair, tuple[Keyframe, Keyframe]] = {}
        # Surveys whose robots are forgotten: workers have their hands full of them all the same.
        self._abandoned: Counter[tuple[KeyframeId, KeyframeId]] = Counter()
        self._partners: dict[str, dict[str, Plan]] = {}
        self._fresh: dict[str, None] = {}
        # Fresh ones whose pairs are all under way, or who have none: they wait for that to change.
        self._parked: set[str] = set()
        self._moved: dict[str, Keyframe] = {}
        self._regular = Waiting()
        self._patrol = Patrol(nanoseconds(options.retry_after_s))
        self._started: Counter[str] = Counter()
        self._outdated = 0

    def judge(self, pair: Pair, *, plausible: bool) -> None:
        """Enter whether a pair's views may meet, as of its newest keyframes."""
        a, b = pair
        if not plausible:
            self._part(pair)
        elif b not in self._partners.get(a, _NOBODY):
            plan = Plan(self._regular.turn)
            self._partners.setdefault(a, {})[b] = self._partners.setdefault(b, {})[a] = plan
        self.again(pair)

    def fresh(self, robot: str) -> None:
        """A robot has a keyframe that no survey has seen; one that waits already keeps its place."""
        self._outdated += sum(pair_of(robot, other) in self._regular for other in self.partners(robot))
        self._parked.discard(robot)
        self._fresh.setdefault(robot)
        self._patrol.keyframe(robot)

    def moved(self, robot: str, earlier: Keyframe | None) -> None:
        """Hold a robot's new keyframe against an earlier one of its own; None if that would tell nothing."""
        self._outdated += self._moved.pop(robot, None) is not None
        if earlier is not None:
            self._moved[robot] = earlier

    def partners(self, robot: str) -> AbstractSet[str]:
        """Robots whose views may meet this one's."""
        return self._partners.get(robot, _NOBODY).keys()

    @property
    def under_way_count(self) -> int:
        """How many surveys are under way."""
        return len(self._in_flight) + self._abandoned.total()

    def workload(self) -> Workload:
        """What waits, and what was started."""
        parked = sum(robot in self._partners for robot in self._parked)
        waiting = {"fresh": len(self._fresh) + parked, "regular": len(self._regular)}
        waiting["moved"] = len(self._moved)
        return Workload(waiting, dict(self._started), self.under_way_count, self._outdated)

    def start(self, now_ns: int) -> tuple[Keyframe, Keyframe] | None:
        """The next pair of keyframes to survey, under way from now on; None if nothing is due or all hands are full."""
        if self.under_way_count >= self.capacity:
            return None
        for name in dict.fromkeys((_TURNS[self._started.total() % len(_TURNS)], *_QUEUES)):
            pair = self._next(name, now_ns)
            if pair is not None:
                return self._start(pair, name, now_ns)
        return None

    def done(self, first: KeyframeId, second: KeyframeId) -> tuple[Keyframe, Keyframe] | None:
        """A survey is over; the keyframes it was about, None if it was not under way."""
        pair = (first.robot, second.robot)
        keyframes = self._in_flight.get(pair)
        if keyframes is None or (keyframes[0].id, keyframes[1].id) != (first, second):
            self._abandoned -= Counter([(first, second)])
            return None
        return self._in_flight.pop(pair)

    def again(self, pair: Pair) -> None:
        """Put a pair back in the queue if one of its keyframes is newer than its last survey."""
        plan = self._partners.get(pair[0], _NOBODY).get(pair[1])
        if plan is None or not self._due(pair):
            return
        self._regular.put(pair, plan, self._news(pair, plan))
        for robot in pair:
            if robot in self._parked:
                self._parked.remove(robot)
                self._fresh[robot] = None

    def under_way(self, name: KeyframeId) -> bool:
        """Is a survey of this keyframe under way?"""
        return any(name == keyframe.id for keyframes in self._in_flight.values() for keyframe in keyframes)

    def forget(self, robot: str) -> None:
        """Take a robot off; its surveys under way are so until they are done, whatever comes of them."""
        for other in list(self.partners(robot)):
            self._part(pair_of(robot, other))
        self._fresh.pop(robot, None)
        self._parked.discard(robot)
        self._moved.pop(robot, None)
        self._patrol.forget(robot)
        for pair in [pair for pair in self._in_flight if robot in pair]:
            first, second = self._in_flight.pop(pair)
            self._abandoned[first.id, second.id] += 1

    def _part(self, pair: Pair) -> None:
        self._regular.drop(pair)
        for robot, other in (pair, pair[::-1]):
            beside = self._partners.get(robot)
            if beside is not None:
                beside.pop(other, None)
                if not beside:
                    del self._partners[robot]

    def _start(self, pair: Pair, queue: str, now_ns: int) -> tuple[Keyframe, Keyframe]:
        keyframes = self._keyframes(pair)
        # Every queue offers pairs that are due, and those have both keyframes.
        assert keyframes is not None  # noqa: S101 - tells the type checker what `_due` has found
        self._in_flight[pair] = keyframes
        self._started[queue] += 1
        if pair[0] == pair[1]:
            del self._moved[pair[0]]
            return keyframes
        self._patrol.tried(pair, now_ns, budgeted=queue == "sweep")
        plan = self._partners.get(pair[0], _NOBODY).get(pair[1])
        if plan is not None:
            self._regular.served(pair, plan, (keyframes[0].pose, keyframes[1].pose))
        for robot in pair:
            self._fresh.pop(robot, None)
            self._parked.discard(robot)
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

    def _news(self, pair: Pair, plan: Plan) -> float:
        """What a survey is expected to tell: how much both views have changed since, and whether groups turn on it."""
        if plan.poses is None:
            return UNSEEN
        robots = (self._roster[pair[0]], self._roster[pair[1]])
        moved = sum(_change(robot, pose) for robot, pose in zip(robots, plan.poses, strict=True))
        return moved + self._boundary(pair)

    def _next(self, queue: str, now_ns: int) -> Pair | None:
        match queue:
            case "fresh":
                return self._next_fresh()
            case "regular":
                return self._next_regular()
            case "moved":
                return self._next_moved()
            case _:
                return self._patrol.next(now_ns, self.partners)

    def _next_fresh(self) -> Pair | None:
        while self._fresh:
            robot = next(iter(self._fresh))
            due = [pair for pair in (pair_of(robot, other) for other in self.partners(robot)) if self._due(pair)]
            if due:
                return min(due, key=self._promise)
            del self._fresh[robot]
            self._parked.add(robot)
        return None

    def _next_moved(self) -> Pair | None:
        return next(((robot, robot) for robot in self._moved if (robot, robot) not in self._in_flight), None)

    def _promise(self, pair: Pair) -> tuple[float, float, Pair]:
        overlaps = self._pairs.overlaps(pair)
        return -sum(overlaps or (0.0,)), self._partners[pair[0]][pair[1]].turn, pair

    def _next_regular(self) -> Pair | None:
        while (pair := self._regular.take()) is not None:
            if self._due(pair):
                return pair
        return None


def _change(robot: Robot, pose: Pose) -> float:
    """How much of a robot's view is another since it was at this pose."""
    keyframe, depth = robot.keyframe, robot.depth
    depth_m = None if depth is None else depth.median_m
    return 0.0 if keyframe is None else change(keyframe.camera, pose, keyframe.pose, depth_m)
