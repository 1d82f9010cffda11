"""From keyframes to overlaps: what is worth a survey, what a survey tells, what stands where none could."""

from __future__ import annotations

from covista_schemas.reports import EventKind

from covista_service.perception.camera import View
from covista_service.perception.survey import Outcome
from covista_service.station import prospects
from covista_service.station.agenda import Agenda
from covista_service.station.events import Happened, Keyframe, KeyframeId, Pair, SurveyDone, SurveyPair
from covista_service.station.groups import Groups
from covista_service.station.options import StationOptions
from covista_service.station.pairs import Pairs, pair_of
from covista_service.station.roster import Robot, Roster


class Surveys:
    """Feeds the agenda with what robots may see in common, and pairs and groups with what surveys find."""

    def __init__(self, roster: Roster, pairs: Pairs, groups: Groups, options: StationOptions) -> None:
        self._roster = roster
        self._pairs = pairs
        self._groups = groups
        self._agenda = Agenda(roster, pairs, options)
        self._to_judge: dict[str, None] = {}
        self._reaches: dict[str, prospects.Reach] = {}
        # Keyframes in use that no survey has seen yet, and those whose first survey is in since the last evaluation.
        self._unseen: dict[str, dict[KeyframeId, Keyframe]] = {}
        self._seen: list[tuple[KeyframeId, int]] = []

    def keyframe(self, robot: Robot, keyframe: Keyframe) -> None:
        """Use a robot's new keyframe. What is known of its pairs stands until they are surveyed anew."""
        robot.keyframe = keyframe
        unseen = self._unseen.get(robot.id, {})
        self._unseen[robot.id] = {held: at for held, at in unseen.items() if self._agenda.under_way(at)}
        self._unseen[robot.id][keyframe.id] = keyframe
        self._to_judge.setdefault(robot.id)
        self._agenda.fresh(robot.id)

    def judge(self, now_ns: int) -> bool:
        """Judge the pairs of all robots with a new keyframe or depth: may they meet, and what is to be expected?

        False if there was nothing to judge.
        """
        together: set[Pair] = set()
        for robot in self._to_judge:
            others = [other.id for other in self._roster if other.keyframe is not None and other.id != robot]
            together.update(pair_of(robot, other) for other in others)
        self._to_judge.clear()
        for pair in sorted(together):
            self._judge(pair, now_ns)
        return bool(together)

    def start(self, now_ns: int) -> list[SurveyPair]:
        """As many surveys as there are hands for."""
        started: list[SurveyPair] = []
        while keyframes := self._agenda.start(now_ns):
            first, second = keyframes
            record = self._pairs[first.id.robot, second.id.robot]
            prior = record.survey if record.measured else None
            started.append(SurveyPair(first.id, second.id, _view(first), _view(second), prior))
        return started

    def done(self, event: SurveyDone, now_ns: int) -> list[Happened]:
        """Take in what a survey found; one that measured nothing leaves the word to the prediction."""
        pair = (event.first.robot, event.second.robot)
        keyframes = self._agenda.done(event.first, event.second)
        first, second = self._roster.get(pair[0]), self._roster.get(pair[1])
        if keyframes is None or first is None or second is None:
            return []
        self._pairs.surveyed(*keyframes, event.survey, now_ns)
        self._agenda.again(pair)
        if event.survey is None:
            text = f"the survey of {pair[0]} and {pair[1]} failed: {event.problem}"
            self._expect(pair, now_ns)
            return [Happened(EventKind.WARNING, now_ns, text, pair)]
        self._note(event.first)
        self._note(event.second)
        self._deepen(first, prospects.depth_of(event.first, event.survey.depths_first))
        self._deepen(second, prospects.depth_of(event.second, event.survey.depths_second))
        if event.survey.outcome is not Outcome.MEASURED:
            self._expect(pair, now_ns)
        else:
            self._groups.see(pair, self._pairs.overlaps(pair))
        return []

    def seen(self) -> tuple[tuple[KeyframeId, int], ...]:
        """Keyframes, with their arrival, whose first survey has come in since this was asked last."""
        seen, self._seen = tuple(self._seen), []
        return seen

    def forget(self, robot: str) -> None:
        """Drop a robot and its pairs."""
        self._agenda.forget(robot)
        self._pairs.forget(robot)
        self._to_judge.pop(robot, None)
        self._reaches.pop(robot, None)
        self._unseen.pop(robot, None)

    def _judge(self, pair: Pair, now_ns: int) -> None:
        first, second = self._roster[pair[0]], self._roster[pair[1]]
        record = self._pairs[pair]
        if first.keyframe is None or second.keyframe is None:
            return
        # What was seen in common is worth another look, if only to find that it is no more.
        overlapped = record.measured and sum(self._pairs.overlaps(pair) or ()) > 0
        reaches = self._reach(first, first.keyframe), self._reach(second, second.keyframe)
        plausible = overlapped or reaches[0].frustum.may_meet(reaches[1].frustum)
        if not record.measured:
            self._expect(pair, now_ns, plausible=plausible)
        self._agenda.judge(pair, plausible=plausible)

    def _reach(self, robot: Robot, keyframe: Keyframe) -> prospects.Reach:
        held = self._reaches.get(robot.id)
        if held is None or not held.is_of(keyframe, robot.depth):
            held = self._reaches[robot.id] = prospects.Reach.of(keyframe, robot.depth)
        return held

    def _expect(self, pair: Pair, now_ns: int, *, plausible: bool = True) -> None:
        """Answer from poses and depths, where both depths are known."""
        first, second = self._roster[pair[0]], self._roster[pair[1]]
        if first.keyframe is not None and second.keyframe is not None and first.depth and second.depth:
            overlaps = (0.0, 0.0)
            if plausible:
                doubt = prospects.UNMATCHED if self._pairs[pair].unmatched else 1.0
                q_first, q_second = prospects.predict(first.keyframe, first.depth, second.keyframe, second.depth)
                overlaps = (doubt * q_first, doubt * q_second)
            self._pairs.predicted(first.keyframe, second.keyframe, overlaps, now_ns)
        self._groups.see(pair, self._pairs.overlaps(pair))

    def _note(self, keyframe: KeyframeId) -> None:
        unseen = self._unseen.get(keyframe.robot, {}).pop(keyframe, None)
        if unseen is not None:
            self._seen.append((keyframe, unseen.arrived_ns))

    def _deepen(self, robot: Robot, depth: prospects.Depth | None) -> None:
        """Take the depth with the most points that is known of a robot's keyframe in use; an older one until then."""
        held = robot.depth
        if depth is None or (robot.keyframe is not None and depth.keyframe != robot.keyframe.id and held is not None):
            return
        if held is None or held.keyframe != depth.keyframe:
            self._to_judge.setdefault(robot.id)
        elif held.points >= depth.points:
            return
        robot.depth = depth


def _view(keyframe: Keyframe) -> View:
    if keyframe.features is None:
        raise ValueError(f"{keyframe.id} has no features yet")
    return View(keyframe.camera, keyframe.pose, keyframe.features)
