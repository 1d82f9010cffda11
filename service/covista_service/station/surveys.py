"""From keyframes to overlaps: what is worth a survey, the surfaces that surveys feed, and what is read from those."""

from __future__ import annotations

from dataclasses import replace

from covista_schemas.reports import EventKind

from covista_service.perception.scene import Evidence
from covista_service.station import prospects
from covista_service.station.agenda import Agenda
from covista_service.station.corrections import Correction, Corrections
from covista_service.station.events import (
    Effect,
    Happened,
    Keyframe,
    KeyframeId,
    SurfacesBuilt,
    SurveyDone,
    SurveyPair,
)
from covista_service.station.forecasts import Forecasts, Read
from covista_service.station.groups import Groups
from covista_service.station.neighbourhoods import Neighbourhoods
from covista_service.station.options import StationOptions
from covista_service.station.outlook import view_of
from covista_service.station.outlooks import Outlooks
from covista_service.station.pairs import Pairs
from covista_service.station.recollection import Recollection
from covista_service.station.roster import Robot, Roster
from covista_service.station.workload import Workload


class Surveys:
    """Feeds the agenda with what robots may see in common, and pairs and groups with what surveys find."""

    def __init__(
        self, roster: Roster, pairs: Pairs, groups: Groups, options: StationOptions, read: Read = prospects.read
    ) -> None:
        self._roster = roster
        self._pairs = pairs
        self._groups = groups
        self._capacity = options.capacity
        self._agenda = Agenda(roster, pairs, options, groups.boundary)
        self._outlooks = Outlooks()
        self._corrections = Corrections()
        self.neighbourhoods = Neighbourhoods(roster, pairs, groups, self._agenda, self._corrections, options)
        meeting = self.neighbourhoods.beside
        self.forecasts = Forecasts(roster, pairs, groups, self._outlooks, meeting, options, read)
        # Arrivals of keyframes whose first survey no surface has been built with yet; those of them that a survey has
        # seen; and those whose first survey is in since the last evaluation.
        self._unseen: dict[str, dict[KeyframeId, int]] = {}
        self._compared: set[KeyframeId] = set()
        self._seen: list[tuple[KeyframeId, int]] = []

    def restore(self, known: Recollection) -> None:
        """Take up what pairs had in common; of the keyframes of that time there is nothing to survey any more."""
        for pair in known.memory.pairs:
            self._pairs.meet(pair.pair, known.answer(pair))
        for unknown in sorted(known.memory.unknown):
            self._pairs.meet(unknown, None)
        self.neighbourhoods.restore(known)

    def keyframe(self, robot: Robot, keyframe: Keyframe) -> None:
        """Use a robot's new keyframe. Until it has a surface of its own it is answered for by the last one's."""
        robot.keyframe = keyframe
        unseen = self._unseen.pop(robot.id, {})
        kept = [name for name in unseen if self._agenda.under_way(name) or self._outlooks.building(name)]
        self._compared.difference_update(unseen.keys() - set(kept))
        self._unseen[robot.id] = {**{name: unseen[name] for name in kept}, keyframe.id: keyframe.arrived_ns}
        self.neighbourhoods.note(robot.id)
        earlier = self._outlooks.keyframe(keyframe)
        self.forecasts.moved(robot.id)
        self._agenda.fresh(robot.id)
        self._agenda.moved(robot.id, earlier)

    def busy(self, robot: str) -> bool:
        """Is a robot's keyframe, of which no surface is known, being surveyed? What comes of it will tell of one."""
        keyframe, outlook = self._roster[robot].keyframe, self._outlooks[robot]
        if keyframe is None or (outlook is not None and outlook.keyframe is keyframe):
            return False
        return self._agenda.under_way(keyframe.id) or self._outlooks.awaited(robot)

    def judge(self, now_ns: int) -> list[str]:
        """Judge the pairs of all robots with a new keyframe or depth, as to whether they may meet; who they are."""
        return self.neighbourhoods.judge(now_ns)

    def start(self, now_ns: int) -> list[Effect]:
        """As many jobs as there are hands for: surfaces that are missing, surveys, then surfaces that can be better."""
        started: list[Effect] = []
        started += self._outlooks.start(self._idle, now_ns, self._compared.__contains__)
        while self._idle > 0:
            keyframes = self._agenda.start(now_ns)
            if keyframes is None:
                break
            started.append(self._survey(*keyframes))
        started += self._outlooks.start(self._idle, now_ns)
        return started

    @property
    def _idle(self) -> int:
        """Hands that have nothing to do."""
        return self._capacity - self._agenda.under_way_count - self._outlooks.under_way

    def take(self, event: SurveyDone | SurfacesBuilt, now_ns: int) -> list[Happened]:
        """Take in what a worker has found."""
        return self._surveyed(event, now_ns) if isinstance(event, SurveyDone) else self._built(event, now_ns)

    def resize(self, capacity: int) -> None:
        """So many surveys and surfaces may be under way at once from now on; what is under way stays so."""
        self._capacity = self._agenda.capacity = capacity

    def workload(self) -> Workload:
        """What waits and what was done."""
        forecasts = self.forecasts
        return replace(self._agenda.workload(), forecasts=forecasts.count, forecasts_waiting=forecasts.waiting)

    def correction(self, robot: str) -> Correction | None:
        """How far a robot's reported pose is off, None while nothing is known of it."""
        return self._corrections[robot]

    @property
    def news(self) -> bool:
        """Has the first survey of a keyframe come in since the last evaluation?"""
        return bool(self._seen)

    def seen(self) -> tuple[tuple[KeyframeId, int], ...]:
        """Keyframes, with their arrival, whose first survey has come in since this was asked last."""
        seen, self._seen = tuple(self._seen), []
        return seen

    def forget(self, robot: str) -> None:
        """Drop a robot and its pairs."""
        self.neighbourhoods.forget(robot)
        self._agenda.forget(robot)
        self._pairs.forget(robot)
        self._outlooks.forget(robot)
        self.forecasts.forget(robot)
        self._corrections.forget(robot)
        self._compared.difference_update(self._unseen.pop(robot, {}))

    def _surveyed(self, event: SurveyDone, now_ns: int) -> list[Happened]:
        """Surfaces are built with what a survey found next."""
        pair = (event.first.robot, event.second.robot)
        keyframes = self._agenda.done(event.first, event.second)
        if keyframes is None or any(robot not in self._roster for robot in pair):
            return []
        evidence = None if event.found is None else Evidence.of(event.found)
        self._outlooks.surveyed(event.first, event.second, evidence, now_ns)
        if pair[0] != pair[1]:
            self._compared.update(
                name for name in (event.first, event.second) if name in self._unseen.get(name.robot, ())
            )
            self.neighbourhoods.take_up(pair)
            self._pairs.surveyed(*keyframes, event.found)
            self.neighbourhoods.look_over(pair)
            self._agenda.again(pair)
        if event.found is None:
            text = f"the survey of {pair[0]} and {pair[1]} failed: {event.problem}"
            return [Happened(EventKind.WARNING, now_ns, text, tuple(dict.fromkeys(pair)))]
        return []

    def _built(self, event: SurfacesBuilt, now_ns: int) -> list[Happened]:
        """All overlaps that new surfaces have part in are read anew."""
        happened: list[Happened] = []
        renewed: dict[str, None] = {}
        before = {name.robot: self._outlooks[name.robot] for name in event.job.keyframes}
        built = self._outlooks.built(event, now_ns)
        for keyframe in built:
            robot, held = self._roster[keyframe.id.robot], before[keyframe.id.robot]
            outlook = self._outlooks[robot.id]
            if outlook is not None:
                again = held is not None and held.keyframe.id == keyframe.id
                happened += self._corrections.note(outlook, now_ns, again=again)
                self.neighbourhoods.deepen(robot, outlook)
                renewed[robot.id] = None
        self.forecasts.renewed(list(renewed), now_ns)
        for keyframe in built:
            self._note(keyframe.id)
        if event.settled is None:
            opened = [name for name, sight in zip(event.job.keyframes, event.job.sights, strict=True) if sight.open]
            robots = tuple(name.robot for name in opened)
            text = f"the surfaces of {' and '.join(robots)} could not be built: {event.problem}"
            happened.append(Happened(EventKind.WARNING, now_ns, text, robots))
        return happened

    def _survey(self, first: Keyframe, second: Keyframe) -> SurveyPair:
        one, other = (view_of(keyframe, self._outlooks.pose(keyframe)) for keyframe in (first, second))
        return SurveyPair(first.id, second.id, one, other)

    def _note(self, keyframe: KeyframeId) -> None:
        if keyframe in self._compared:
            self._compared.discard(keyframe)
            self._seen.append((keyframe, self._unseen[keyframe.robot].pop(keyframe)))
