"""Whose views may meet, as far as is known: judged when a robot has a new keyframe or depth, among those near it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import islice

import numpy as np

from covista_service.perception.camera import Pose
from covista_service.perception.frustum import Frusta
from covista_service.station.agenda import Agenda
from covista_service.station.corrections import Corrections
from covista_service.station.events import Keyframe, Pair
from covista_service.station.grid import Grid
from covista_service.station.groups import Groups
from covista_service.station.horizon import Horizon
from covista_service.station.options import StationOptions, nanoseconds
from covista_service.station.outlook import Outlook
from covista_service.station.pairs import FAILED, NOT_SURVEYED, Answer, Judged, Pairs, apart, pair_of
from covista_service.station.reach import Reach, depth_of, farthest_m
from covista_service.station.recollection import Recollection
from covista_service.station.roster import Robot, Roster

# A smoothed overlap that has come down so far need not be told any more zeros.
_NEGLIGIBLE = 1e-4
# While views are endless, anybody may see the same as anybody: this many of the nearest are enough to begin with.
_CROWD = 32
# When views are endless no longer, so many are judged anew at a time beside those with news.
_AT_ONCE = 16


class Neighbourhoods:
    """Partners of every robot: those whose views may meet its own, and those with whom images have said so.

    Who is no partner shares nothing: of such a pair nothing is kept but when its two robots were judged, and a row of
    zeros in the groups. So a keyframe costs what its neighbours cost, whatever the size of the swarm.

    Of those whom it may meet for no other reason than that a view is endless a robot takes the nearest 32, each time it
    is judged; the others are left to the sweep, until depths are known.
    """

    def __init__(
        self,
        roster: Roster,
        pairs: Pairs,
        groups: Groups,
        agenda: Agenda,
        corrections: Corrections,
        options: StationOptions,
    ) -> None:
        self._roster = roster
        self._pairs = pairs
        self._groups = groups
        self._agenda = agenda
        self._corrections = corrections
        self._unknown_after_ns = nanoseconds(options.unknown_after_s)
        self._to_judge: dict[str, None] = {}
        self._later: dict[str, None] = {}
        self._reaches: dict[str, Reach] = {}
        self._grid = Grid()
        # Of robots that are far from where their keyframes were taken: what they see from where they stand.
        self._standing: dict[str, Reach] = {}
        self._ground = Grid()
        self._horizon = Horizon()
        self._judged: dict[str, Judged] = {}
        # By age, the oldest first; and those too old for a pair of two such to stand for anything.
        self._ageing: dict[str, None] = {}
        self._lapsed: dict[str, None] = {}
        # Pairs that have parted, and whose smoothed overlap has not come down yet.
        self._receding: dict[str, dict[str, None]] = {}

    def __getitem__(self, robot: str) -> Judged | None:
        """By which keyframe a robot was judged last, None if it was not yet."""
        return self._judged.get(robot)

    def restore(self, known: Recollection) -> None:
        """Take up who was judged when: who has no record with another shares nothing with it."""
        judged = [(robot.judged_ns, robot) for robot in known.memory.robots if robot.judged_ns is not None]
        for judged_ns, robot in sorted(judged, key=lambda one: one[0]):
            keyframe = known.keyframe(robot)
            if keyframe is not None:
                self._judged[robot.id], self._ageing[robot.id] = Judged(keyframe, judged_ns), None

    def note(self, robot: str) -> None:
        """A robot has something new: judge it next time."""
        self._to_judge.setdefault(robot)

    def deepen(self, robot: Robot, outlook: Outlook) -> None:
        """Take the depth that a robot's surface tells; who may see what it sees is judged by it."""
        depth, held = depth_of(outlook), robot.depth
        if depth is None:
            return
        if held is None or held.keyframe != depth.keyframe:
            self.note(robot.id)
        elif held.points >= depth.points:
            return
        robot.depth = depth
        if self._horizon.note(robot.id, farthest_m(depth)):
            self._later |= {name: None for name, reach in self._reaches.items() if reach.endless}

    def judge(self, now_ns: int) -> list[str]:
        """Judge the pairs of all robots with a new keyframe or depth; who they are."""
        for name in list(islice(self._later, _AT_ONCE)):
            del self._later[name]
            self.note(name)
        names = list(self._to_judge)
        # All are where they are now before any is held against another. Whoever fails costs nobody else a turn.
        for name in names:
            self._settle(name)
        for name in names:
            del self._to_judge[name]
            robot = self._roster[name]
            if robot.keyframe is not None:
                self._judge(robot, robot.keyframe, now_ns)
        return names

    def take_up(self, pair: Pair) -> None:
        """A survey of a pair is in: what stood for those who share nothing stands until surfaces are built."""
        self._pairs.meet(pair, self._apart(*pair))

    def look_over(self, pair: Pair) -> None:
        """A survey that verifies a pair makes it worth reading; one that does not ends what was kept for that alone."""
        if pair[0] not in self._reaches or pair[1] not in self._reaches:
            return
        one, other = self._reaches[pair[0]], self._reaches[pair[1]]
        partners = pair[1] in self._agenda.partners(pair[0])
        if (partners and one.frustum.may_meet(other.frustum)) or self._worth_another_look(pair):
            self._meet(pair, None)
        elif self._stand_together(pair):
            self._agenda.judge(pair, plausible=False)
        else:
            self._part(pair)

    def beside(self, robot: str, pose: Pose | None) -> list[str]:
        """Robots whose views may meet this one's now that it is far from its keyframe, at this pose.

        None while it is not, nor to be held against others there. Nobody while it has not been judged.
        """
        reach = self._reaches.get(robot)
        if reach is None or pose is None:
            self._step_back(robot)
            return []
        keyframe = replace(reach.keyframe, pose=pose)
        there = Reach.of(keyframe, reach.depth, self._horizon.farthest_m, self._corrections[robot])
        self._standing[robot] = there
        self._ground.put(robot, there.box)
        return list(dict.fromkeys(self._meeting(robot, there) + self._around(robot)))

    def place(self, robot: str) -> None:
        """A robot takes part in the groups from now on, with all that is known of its pairs."""
        for other in self._pairs.beside(robot):
            pair = pair_of(robot, other)
            self._groups.see(pair, self._pairs.overlaps(pair))
        self._share_nothing(robot, self._groups.robots)

    def expire(self, now_ns: int) -> bool:
        """Let the answers about robots that have not been judged for long stand no more; False if there are none."""
        lapsed: list[str] = []
        for robot in self._ageing:
            if now_ns - self._judged[robot].first_ns < self._unknown_after_ns:
                break
            lapsed.append(robot)
        for robot in lapsed:
            del self._ageing[robot]
            others = [other for other in self._lapsed if pair_of(robot, other) not in self._pairs]
            self._groups.see_row(robot, others, None)
            self._lapsed[robot] = None
        return bool(lapsed)

    def forget(self, robot: str) -> None:
        """Drop a robot."""
        self._to_judge.pop(robot, None)
        self._later.pop(robot, None)
        self._reaches.pop(robot, None)
        self._grid.remove(robot)
        self._step_back(robot)
        self._horizon.forget(robot)
        for places in (self._judged, self._ageing, self._lapsed):
            places.pop(robot, None)
        for other in self._receding.pop(robot, {}):
            _discard(self._receding, other, robot)

    def _settle(self, name: str) -> None:
        robot, held = self._roster[name], self._reaches.get(name)
        keyframe = robot.keyframe
        if keyframe is None or (held is not None and held.is_of(keyframe, robot.depth) and not held.endless):
            return
        try:
            reach = Reach.of(keyframe, robot.depth, self._horizon.farthest_m, self._corrections[name])
        except Exception:
            del self._to_judge[name]
            raise
        self._reaches[name] = reach
        self._grid.put(name, reach.box)

    def _step_back(self, robot: str) -> None:
        """A robot is where its keyframe was taken."""
        if self._standing.pop(robot, None) is not None:
            self._ground.remove(robot)

    def _around(self, robot: str) -> list[str]:
        """Whom a robot may meet only if one of the two, or both, are looked at where they stand by now."""
        reach, there = self._reaches[robot], self._standing.get(robot)
        found = self._meeting(robot, reach, standing=True)
        if there is not None:
            found += self._meeting(robot, there) + self._meeting(robot, there, standing=True)
        return found

    def _stand_together(self, pair: Pair) -> bool:
        """Do two robots' views meet from where one of them, or both, stand by now?"""
        first, second = ((self._reaches[robot], self._standing.get(robot)) for robot in pair)
        couples = ((first[1], second[0]), (first[0], second[1]), (first[1], second[1]))
        return any(one and other and one.frustum.may_meet(other.frustum) for one, other in couples)

    def _meeting(self, robot: str, reach: Reach, *, standing: bool = False) -> list[str]:
        """Robots whose views may meet this one, by their keyframes or by where those stand that are far from there."""
        grid, reaches = (self._ground, self._standing) if standing else (self._grid, self._reaches)
        near = {other: reaches[other] for other in grid.meeting(reach.box) if other != robot}
        vague = near if reach.endless else {other: its for other, its in near.items() if its.endless}
        if len(vague) <= _CROWD:
            return _met(reach, near)
        firm = {other: its for other, its in near.items() if other not in vague}
        # A view is endless to one side: among so many of the nearest there are as a rule enough.
        return _met(reach, firm) + _met(reach, _nearest(reach, vague, 4 * _CROWD))[:_CROWD]

    def _judge(self, robot: Robot, keyframe: Keyframe, now_ns: int) -> None:
        name, former = robot.id, self._judged.get(robot.id)
        partners = dict.fromkeys(self._meeting(name, self._reaches[name]))
        around = dict.fromkeys(self._around(name))
        for other in self._pairs.beside(name):
            # Of who has sent no keyframe yet since the station started, nothing is known but what was.
            if other not in partners and other in self._reaches:
                pair = pair_of(name, other)
                if self._worth_another_look(pair):
                    partners[other] = None
                elif other in around:
                    # Their keyframes show nothing in common, so that no survey would help.
                    self._agenda.judge(pair, plausible=False)
                else:
                    self._part(pair)
        for other in around:
            self._keep(pair_of(name, other), self._apart(name, other))
        for other in partners:
            self._meet(pair_of(name, other), self._apart(name, other))
        if former is None or former.keyframe is not keyframe:
            self._enter(name, Judged(keyframe, now_ns))
            self._recede(name)

    def _enter(self, robot: str, judged: Judged) -> None:
        """A robot is judged by another keyframe: what it shares with nobody else stands from now on."""
        first, lapsed = robot not in self._judged, robot in self._lapsed
        for places in (self._ageing, self._lapsed):
            places.pop(robot, None)
        self._judged[robot], self._ageing[robot] = judged, None
        if first or lapsed:
            self._share_nothing(robot, self._judged if first else self._lapsed)

    def _apart(self, robot: str, other: str) -> Answer | None:
        """What stands for two robots as those whose views cannot meet, as they were judged last."""
        first, second = (self._judged.get(name) for name in pair_of(robot, other))
        if first is None or second is None or (robot in self._lapsed and other in self._lapsed):
            return None
        return apart(first, second)

    def _meet(self, pair: Pair, answer: Answer | None) -> None:
        self._keep(pair, answer)
        self._agenda.judge(pair, plausible=True)

    def _keep(self, pair: Pair, answer: Answer | None) -> None:
        self._pairs.meet(pair, answer)
        for robot, other in (pair, pair[::-1]):
            _discard(self._receding, robot, other)

    def _part(self, pair: Pair) -> None:
        """What is known of a pair is that it shares nothing."""
        self._agenda.judge(pair, plausible=False)
        answer = self._pairs.part(pair).answer
        current = tuple(self._reaches[robot].keyframe.id for robot in pair)
        held = self._groups.see(pair, (0.0, 0.0), again=answer is not None and answer.rests_on == current)
        if held is not None and held > _NEGLIGIBLE:
            for robot, other in (pair, pair[::-1]):
                self._receding.setdefault(robot, {})[other] = None

    def _recede(self, robot: str) -> None:
        """Another keyframe that shares nothing with those that it shared something with."""
        for other in list(self._receding.get(robot, ())):
            pair = pair_of(robot, other)
            held = None if pair in self._pairs else self._groups.see(pair, (0.0, 0.0))
            if held is None or held <= _NEGLIGIBLE:
                _discard(self._receding, robot, other)
                _discard(self._receding, other, robot)

    def _share_nothing(self, robot: str, others: Iterable[str]) -> None:
        """Enter zeros for a robot and all of those whom it is known to share nothing with."""
        judged = self._judged.get(robot)
        if judged is None:
            return
        lapsed = self._lapsed if robot in self._lapsed else {}
        # Said of all robots when one comes: what is known of pairs is asked for once.
        beside = {robot, *self._pairs.beside(robot)}
        known = [other for other in others if other in self._judged and other not in beside and other not in lapsed]
        self._groups.see_row(robot, known, 0.0)

    def _worth_another_look(self, pair: Pair) -> bool:
        """Do images say that there is something in common? They outrank what poses and depths say of views.

        What the last survey came to holds until another says otherwise, whatever keyframes and surfaces come between.
        Without any, what was seen in common before is looked at again.
        """
        record = self._pairs[pair]
        if record.outcome in (NOT_SURVEYED, FAILED) and not record.verified:
            return (record.measured or record.remembered) and sum(self._pairs.overlaps(pair) or ()) > 0
        return record.verified


def _met(reach: Reach, near: Mapping[str, Reach]) -> list[str]:
    """Who of those near it a view may meet, by the faces of the frusta."""
    if not near:
        return []
    meet = Frusta([its.frustum for its in near.values()]).may_meet(reach.frustum)
    return [other for other, met in zip(near, meet.tolist(), strict=True) if met]


def _nearest(reach: Reach, others: Mapping[str, Reach], count: int) -> dict[str, Reach]:
    """So many of others at most, the nearest first."""
    names = list(others)
    centres_m = np.array([its.keyframe.pose.centre_m for its in others.values()]).reshape(-1, 3)
    order = np.linalg.norm(centres_m - reach.keyframe.pose.centre_m, axis=1).argsort(kind="stable")
    return {names[k]: others[names[k]] for k in order[:count].tolist()}


def _discard(places: dict[str, dict[str, None]], robot: str, other: str) -> None:
    held = places.get(robot)
    if held is not None:
        held.pop(other, None)
        if not held:
            del places[robot]
