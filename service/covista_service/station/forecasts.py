"""What robots see in common from where they stand now, by surfaces that are known: no image is needed for it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Pose, relative
from covista_service.perception.flow import flow
from covista_service.perception.surface import Surface
from covista_service.perception.visibility import Seeing
from covista_service.station.allowance import Allowance
from covista_service.station.events import Keyframe, Pair
from covista_service.station.groups import Groups
from covista_service.station.options import StationOptions, nanoseconds
from covista_service.station.outlook import Outlook, Prospect, Ratios, depths_m, stands
from covista_service.station.outlooks import Outlooks
from covista_service.station.pairs import Answer, Pairs, pair_of
from covista_service.station.roster import Fix, Robot, Roster

# The overlaps of pairs of prospects, as `prospects.read` tells them.
Read = Callable[[Sequence[Prospect], NDArray[np.integer], Sequence[Ratios], Sequence[int]], list[Answer]]
# Robots whose views may meet that of one that is at a pose far from its newest keyframe's; None: it is not.
Meeting = Callable[[str, Pose | None], Sequence[str]]
# A robot has moved if it has turned by so much, or gone by so large a share of the median depth that it sees.
_TURNED_RAD, _GONE_SHARE = math.radians(1.0), 0.02
# So many times that far from where its keyframe was taken, a robot may meet others than from there.
_FAR = 5.0
# Ordered pairs in one turn: some ten milliseconds.
_AT_ONCE = 256


@dataclass(slots=True)
class _Turn:
    """A robot that waits: partners `rest` still to be read, None for all; `again` if it has moved since it began."""

    rest: list[str] | None = None
    again: bool = False


class Forecasts:
    """Reads the overlaps of robots that have moved anew, who has waited longest first, and never more than allowed.

    Both robots of a pair stand where they reported last; what they see is their last surface, as it looks from there.
    """

    def __init__(
        self,
        roster: Roster,
        pairs: Pairs,
        groups: Groups,
        outlooks: Outlooks,
        meeting: Meeting,
        options: StationOptions,
        read: Read,
    ) -> None:
        """`meeting` tells whose views may meet a robot's from where it is, `read` the overlaps of prospects."""
        self._roster = roster
        self._pairs = pairs
        self._groups = groups
        self._outlooks = outlooks
        self._meeting = meeting
        self._overlaps_of = read
        self._allowance = Allowance(options.forecasts_per_s)
        self._unknown_after_ns = nanoseconds(options.unknown_after_s)
        self._allowed = options.forecasts_per_s > 0
        self._prospects: dict[str, Prospect] = {}
        # Robots that have told a pose or a keyframe, and those of them that have moved, in order.
        self._heard: dict[str, None] = {}
        self._waiting: dict[str, _Turn] = {}
        self.count = 0

    @property
    def waiting(self) -> int:
        """How many robots have moved and wait for their overlaps to be read anew."""
        return len(self._waiting)

    def moved(self, robot: str) -> None:
        """A robot has told where it is, or has a new keyframe."""
        if self._allowed:
            self._heard.setdefault(robot)

    def renewed(self, robots: Sequence[str], now_ns: int) -> None:
        """Surfaces of these robots are new: all overlaps that they have part in are read at once."""
        for robot in robots:
            self._waiting.pop(robot, None)
        self._read({robot: self._beside(robot) for robot in robots}, robots, now_ns, anew=True)

    def look(self, now_ns: int) -> bool:
        """Read the overlaps of robots that have moved, as many as are allowed by now; False if there were none."""
        for name in self._heard:
            robot = self._roster.get(name)
            if robot is not None and self._is_news(robot):
                self._waiting.setdefault(name, _Turn())
        self._heard.clear()
        wanted, begun = self._next(min(self._allowance.at(now_ns), _AT_ONCE))
        if not wanted:
            return False
        read = 2 * self._read(wanted, begun, now_ns)
        self._allowance.spend(read)
        self.count += read
        return True

    def forget(self, robot: str) -> None:
        """Drop a robot."""
        self._heard.pop(robot, None)
        self._waiting.pop(robot, None)
        self._prospects.pop(robot, None)

    def _next(self, room: int) -> tuple[dict[str, list[str]], list[str]]:
        """Who is to be read with whom now, the first in the row first, and those of them whose turn begins.

        The last one is perhaps not read with all of its partners: the others follow in the next turn.
        """
        wanted: dict[str, list[str]] = {}
        begun: list[str] = []
        for robot in list(islice(self._waiting, max(room, 0))):
            if room <= 0:
                break
            turn = self._waiting[robot]
            rest = self._beside(robot) if turn.rest is None else turn.rest
            if turn.rest is None:
                begun.append(robot)
            count = max(room // 2, 1)
            wanted[robot] = rest[:count]
            room -= 2 * len(wanted[robot])
            if len(rest) > count:
                turn.rest = rest[count:]
                break
            del self._waiting[robot]
            if turn.again:
                self._waiting[robot] = _Turn()
        return wanted, begun

    def _beside(self, robot: str) -> list[str]:
        """All that something is known with, and, where a robot is far from its keyframe, all that its view may meet."""
        beside = dict.fromkeys(self._pairs.beside(robot))
        return sorted(beside | dict.fromkeys(self._meeting(robot, self._far(robot))))

    def _far(self, robot: str) -> Pose | None:
        """Where a robot is that is far from where its keyframe was taken."""
        source, known = self._outlooks[robot], self._roster[robot]
        if source is None or known.fix is None or known.keyframe is None:
            return None
        return known.fix.pose if _apart(known.keyframe.pose, known.fix.pose, source, _FAR) else None

    def _read(self, wanted: dict[str, list[str]], begun: Sequence[str], now_ns: int, *, anew: bool = False) -> int:
        """Read robots with their partners, and how many pairs that were; `anew` from surfaces that are new.

        `begun` are those whose turn begins: all their partners are read for where they stand now.
        """
        self._bring_up_to_date(wanted, begun)
        pairs = [
            pair
            for pair in dict.fromkeys(pair_of(robot, other) for robot in wanted for other in wanted[robot])
            if pair[0] in self._prospects and pair[1] in self._prospects and (anew or not self._is_read(pair))
        ]
        place: dict[str, int] = {}
        for pair in pairs:
            for name in pair:
                place.setdefault(name, len(place))
        answers = self._overlaps_of(
            [self._prospects[name] for name in place],
            np.array([(place[a], place[b]) for a, b in pairs], np.int64).reshape(-1, 2),
            [self._outlooks.scales.ratios(*pair) for pair in pairs],
            [now_ns if anew else self._since_ns(pair) for pair in pairs],
        )
        for pair, answer in zip(pairs, answers, strict=True):
            # What rests on surfaces that old is unknown.
            if now_ns - answer.computed_ns < self._unknown_after_ns:
                self._enter(pair, answer)
        return len(pairs)

    def _enter(self, pair: Pair, answer: Answer) -> None:
        if pair not in self._pairs and answer.overlaps == (0.0, 0.0):
            # Of those who share nothing nothing is kept.
            return
        held = self._pairs[pair].answer
        again = self._pairs.enter(pair, answer)
        moved = again and held is not None and (answer.poses is None or not held.stands_for(*answer.poses))
        self._groups.see(pair, self._pairs.overlaps(pair), again=again, moved=moved)

    def _is_read(self, pair: Pair) -> bool:
        """Does the answer in force say how these two stand now?"""
        held, one, other = self._pairs[pair].answer, self._prospects[pair[0]], self._prospects[pair[1]]
        return (
            held is not None
            and (held.first, held.second) == (one.outlook.keyframe, other.outlook.keyframe)
            and held.stands_for(one.pose, other.pose)
            and held.rests_on == (one.source.keyframe.id, other.source.keyframe.id)
        )

    def _since_ns(self, pair: Pair) -> int:
        """Since when there have been the surfaces that an answer rests on: new poses make none younger."""
        return max(self._prospects[name].source.since_ns for name in pair)

    def _is_news(self, robot: Robot) -> bool:
        """Does a robot see something else than when it was last read?"""
        source, held = self._outlooks[robot.id], self._prospects.get(robot.id)
        if source is None or robot.fix is None:
            return False
        if held is None or held.source is not source or held.outlook.keyframe is not robot.keyframe:
            return True
        return _apart(held.reported, robot.fix.pose, source)

    def _bring_up_to_date(self, wanted: dict[str, list[str]], begun: Sequence[str]) -> None:
        """Take where robots and partners stand now; who has moved, and whose turn has not just `begun`, is to wait."""
        names = dict.fromkeys(name for robot in wanted for name in (robot, *wanted[robot]))
        robots = [self._roster.get(name) for name in names if name in wanted or self._may_have_moved(name)]
        seen = [_Seen(*known) for robot in robots if robot is not None and (known := self._known(robot)) is not None]
        heirs, away = [one for one in seen if one.outlook is None], [one for one in seen if one.is_away]
        moves = [(one, one.keyframe.pose) for one in heirs] + [(one, one.fix.pose) for one in away]
        surfaces = _carried_along(moves)
        for one, surface in zip(heirs, surfaces, strict=False):
            one.outlook = one.inherited(surface)
        there = dict(zip((one.robot for one in away), surfaces[len(heirs) :], strict=True))
        for one in seen:
            self._prospects[one.robot] = one.prospect(there.get(one.robot))
            if one.robot not in begun and self._allowed:
                turn = self._waiting.setdefault(one.robot, _Turn())
                turn.again = turn.rest is not None

    def _may_have_moved(self, robot: str) -> bool:
        return robot in self._waiting or robot in self._heard or robot not in self._prospects

    def _known(self, robot: Robot) -> tuple[Outlook, Keyframe, Fix, Outlook | None] | None:
        """What is needed to say what a robot sees now; None if nothing new is to be said, or nothing at all."""
        source, keyframe, fix = self._outlooks[robot.id], robot.keyframe, robot.fix
        if source is None or keyframe is None or fix is None or not self._is_news(robot):
            return None
        held = self._prospects.get(robot.id)
        if source.keyframe is keyframe:
            return source, keyframe, fix, source
        inherited = held is not None and held.source is source and held.outlook.keyframe is keyframe
        return source, keyframe, fix, held.outlook if held is not None and inherited else None


@dataclass(slots=True, eq=False)
class _Seen:
    """Where a robot is now: its last outlook with a surface of its own, its newest keyframe and pose.

    `outlook` is that of the newest keyframe, None until it has inherited one.
    """

    source: Outlook
    keyframe: Keyframe
    fix: Fix
    outlook: Outlook | None

    @property
    def robot(self) -> str:
        return self.keyframe.id.robot

    @property
    def is_away(self) -> bool:
        """Is the robot not where its newest keyframe was taken?"""
        return _apart(self.keyframe.pose, self.fix.pose, self.source)

    def inherited(self, surface: Surface) -> Outlook:
        """The keyframe's outlook as the last one's surface tells it: no points of its own, nothing matched."""
        pose = stands(self.source, self.keyframe.pose)
        return Outlook(self.keyframe, pose, surface, 0, {}, depths_m(surface), self.source.since_ns)

    def prospect(self, surface: Surface | None) -> Prospect:
        """What the robot sees: by its keyframe's outlook, or by this surface where it is now."""
        outlook = self.source if self.outlook is None else self.outlook
        if surface is None:
            return Prospect.of(outlook, self.source)
        pose = stands(self.source, self.fix.pose)
        return Prospect(self.source, outlook, self.fix.pose, pose, surface, self.fix.time_ns)


def _carried_along(moves: Sequence[tuple[_Seen, Pose]]) -> list[Surface]:
    """The surface of each source as it looks from a pose that its robot has reported."""
    if not moves:
        return []
    motions = [relative(one.source.keyframe.pose, reported) for one, reported in moves]
    return flow(
        [Seeing(one.source.keyframe.camera, one.source.surface) for one, _ in moves],
        np.array([rotation for rotation, _ in motions]),
        np.array([translation for _, translation in motions]),
        [one.keyframe.camera for one, _ in moves],
    )


def _apart(one: Pose, other: Pose, outlook: Outlook, times: float = 1.0) -> bool:
    """Do two poses differ by what can be noticed in such an outlook, or by so many times that?"""
    gone = one.centre_m - other.centre_m
    # R R' has the trace 1 + 2 cos(angle).
    trace = float(np.vdot(one.world_from_camera, other.world_from_camera))
    least_trace = 1 + 2 * math.cos(times * _TURNED_RAD)
    return trace < least_trace or float(gone @ gone) > (times * _GONE_SHARE * outlook.depths_m[1]) ** 2
