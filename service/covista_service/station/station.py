"""The station: events in, effects out. It has no clock and no I/O; the same events give the same effects."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from covista_schemas.reports import EventKind, Status

from covista_service.perception.camera import Pose
from covista_service.station import prospects
from covista_service.station.census import Census
from covista_service.station.events import (
    Effect,
    Event,
    FeaturesExtracted,
    ForgetRobot,
    GroupsChanged,
    GroupsEvaluated,
    Happened,
    InterruptedTickError,
    Keyframe,
    KeyframeArrived,
    MessageDropped,
    MessagesReceived,
    PoseArrived,
    SettingsGiven,
    SurfacesBuilt,
    SurveyDone,
    Tick,
    TokenLost,
    TokenSeen,
)
from covista_service.station.forecasts import Read
from covista_service.station.groups import Groups, Ungrouped
from covista_service.station.keyframes import Keyframes
from covista_service.station.memory import Memory
from covista_service.station.options import GroupingOptions, StationOptions, nanoseconds
from covista_service.station.pairs import Pairs
from covista_service.station.presence import Presence
from covista_service.station.recollection import Recollection, sensible
from covista_service.station.roster import Robot, Roster
from covista_service.station.snapshot import RobotView, Snapshot
from covista_service.station.surveys import Surveys
from covista_service.station.timeline import Timeline

# A clock further off than this is worth a look.
_CLOCK_OFF_NS = nanoseconds(10)


class Station:
    """Keeps the roster, what every pair sees in common, and the groups.

    Arrivals only change what is known; a Tick decides what follows: presence, surveys, groups.
    """

    def __init__(self, options: StationOptions | None = None, read: Read = prospects.read) -> None:
        """`read` tells the overlaps of pairs of prospects."""
        self.options = options or StationOptions()
        self._unknown_after_ns = nanoseconds(self.options.unknown_after_s)
        self._timeline = Timeline()
        self._roster = Roster(self.options)
        self._presence = Presence(self._roster)
        self._pairs = Pairs(self._unknown_after_ns)
        self._groups = Groups(self.options)
        self._surveys = Surveys(self._roster, self._pairs, self._groups, self.options, read)
        self._keyframes = Keyframes(self._roster, self._surveys, self.options.capacity)
        self._views: dict[str, RobotView] = {}
        # Robots by id, and those that stand in no group, until somebody comes or goes.
        self._sorted: list[str] | None = None
        self._outside: Ungrouped | None = None
        self._snapshot: Snapshot | None = None

    def receive(self, event: Event, now_ns: int) -> list[Effect]:
        """Take in one event that happened at `now_ns`, even if that is set back, and say what is to be done."""
        if not isinstance(event, Tick):
            self._snapshot = None
        station_ns = self._timeline.at(now_ns)
        return self._timeline.told(self._receive(self._timeline.heard(event), station_ns))

    @property
    def waits(self) -> bool:
        """Is there news, of a survey or of poses, that should not wait for the next event?"""
        return self._surveys.news or self._surveys.forecasts.waiting > 0

    def restore(self, memory: Memory, now_ns: int) -> None:
        """Go on where the station before has ended, as far as its memory makes sense; ValueError once there are robots.

        Nothing of it has happened now: only what is found to be otherwise is told of, from the next Tick on.
        """
        if any(self._roster):
            raise ValueError("a station that knows robots already cannot take up those of another")
        now_ns = self._timeline.at(now_ns)
        known = Recollection(sensible(memory, now_ns))
        self._roster.restore(known, now_ns)
        self._surveys.restore(known)
        self._sorted = self._outside = self._snapshot = None
        for robot in self._roster:
            if robot.status is not Status.GONE:
                self._place(robot)
        self._groups.restore(known.memory, self._ungrouped(), self._timeline.wall_ns(now_ns))

    def resize(self, capacity: int) -> None:
        """So many extractions, and so many surveys and surfaces, may be under way at once from now on.

        ValueError for fewer than one.
        """
        if capacity < 1:
            raise ValueError(f"a station needs at least one hand, not {capacity}")
        self.options = replace(self.options, capacity=capacity)
        self._surveys.resize(capacity)
        self._keyframes.resize(capacity)

    def set_grouping(self, options: GroupingOptions) -> None:
        """Group by other settings from the next Tick on."""
        self.options = replace(self.options, grouping=options)
        self._groups.set_options(options)
        self._snapshot = None

    def snapshot(self, now_ns: int) -> Snapshot:
        """All that is known, for ages as of `now_ns`; cheap while nothing changes."""
        wall_ns, now_ns = now_ns, self._timeline.peek(now_ns)
        if self._snapshot is None:
            for robot in self._roster:
                if robot.id not in self._views:
                    self._views[robot.id] = self._view(robot)
            self._snapshot = Snapshot(
                now_ns,
                {name: self._views[name] for name in self._names()},
                self._groups.view,
                self._groups.similarity,
                self._pairs.records(),
                nanoseconds(self.options.decay_after_s),
                self._unknown_after_ns,
                self._surveys.workload(),
                wall_ns,
            )
        return replace(self._snapshot, now_ns=now_ns, wall_ns=wall_ns)

    def census(self) -> Census:
        """The station in numbers, as of the last Tick where time matters."""
        view, robots = self._groups.view, list(self._roster)
        return Census(
            accounts=self._roster.accounts(),
            robots=Counter(robot.status or Status.LIVE for robot in robots),
            ungrouped=Counter(reason for _, reason in view.ungrouped),
            clocks_off=sum(abs(robot.clock_offset_ns or 0) > _CLOCK_OFF_NS for robot in robots),
            groups=len(view.groups),
            revision=view.revision,
            matrix_revision=self._groups.similarity.revision,
            keyframes=sum(robot.keyframe is not None for robot in robots),
            pairs=len(self._pairs),
            workload=self._surveys.workload(),
        )

    def _receive(self, event: Event, now_ns: int) -> list[Effect]:
        match event:
            case MessagesReceived():
                self._messages_received(event)
            case MessageDropped():
                self._message_dropped(event)
            case KeyframeArrived(keyframe):
                return self._keyframe_arrived(keyframe)
            case PoseArrived():
                self._pose_arrived(event)
            case TokenSeen() | TokenLost():
                self._token(event, now_ns)
            case FeaturesExtracted():
                return self._features_extracted(event)
            case SurveyDone() | SurfacesBuilt():
                return self._take(event, now_ns)
            case SettingsGiven() | ForgetRobot():
                return self._obey(event, now_ns)
            case Tick():
                return self._tick(now_ns)
        return []

    def _obey(self, event: SettingsGiven | ForgetRobot, now_ns: int) -> list[Effect]:
        """What a person wants."""
        if isinstance(event, SettingsGiven):
            if event.options == self.options.grouping:
                return []
            self.set_grouping(event.options)
            return [Happened(EventKind.SETTINGS, now_ns, event.text, by=event.by)]
        return [self._forgotten(event.robot, now_ns, event.by)] if event.robot in self._roster else []

    def _forgotten(self, robot: str, now_ns: int, by: str | None = None) -> Happened:
        self._forget(robot)
        return Happened(EventKind.STATUS, now_ns, f"{robot} is forgotten", (robot,), by=by)

    def _token(self, event: TokenSeen | TokenLost, now_ns: int) -> None:
        if isinstance(event, TokenSeen):
            self._touch(event.robot)
            self._roster.token_seen(event.robot, event.boot, now_ns)
        else:
            self._roster.token_lost(event.robot, event.boot, now_ns)

    def _messages_received(self, event: MessagesReceived) -> None:
        robot = self._touch(event.robot)
        self._hear(robot, event.arrived_ns)
        robot.ledgers[event.topic].hear(event.sequences, event.kept)
        if event.topic == "keyframe":
            robot.announce(event.sequences)

    def _message_dropped(self, event: MessageDropped) -> None:
        robot = self._touch(event.robot)
        self._hear(robot, event.arrived_ns)
        robot.last_problem = event.text
        ledger = robot.ledgers[event.topic]
        if event.runs:
            ledger.give_up(event.code, event.runs)
        else:
            ledger.drop(event.code, event.count, counted=event.counted)

    def _hear(self, robot: Robot, arrived_ns: int, time_ns: int | None = None) -> None:
        robot.heard(arrived_ns, time_ns, self._timeline.wall_ns(arrived_ns))

    def _keyframe_arrived(self, keyframe: Keyframe) -> list[Effect]:
        robot = self._touch(keyframe.id.robot)
        self._hear(robot, keyframe.arrived_ns, keyframe.time_ns)
        if not self._keyframes.enters(robot, keyframe):
            return []
        self._locate(robot, keyframe.pose, keyframe.time_ns, keyframe.id.boot)
        return self._keyframes.take(robot, keyframe)

    def _features_extracted(self, event: FeaturesExtracted) -> list[Effect]:
        robot = self._keyframes.extracted(event)
        if robot is not None:
            self._touch(robot.id)
        return self._keyframes.start()

    def _pose_arrived(self, event: PoseArrived) -> None:
        robot = self._touch(event.robot)
        self._hear(robot, event.arrived_ns, event.time_ns)
        ledger, message = robot.ledgers["pose"], (event.boot, event.sequence)
        if not ledger.take(message):
            return
        newest = robot.enters(event.boot, event.arrived_ns) and event.sequence > robot.pose_sequence
        if newest:
            robot.pose_sequence = event.sequence
            newest = self._locate(robot, event.pose, event.time_ns, event.boot)
        ledger.settle(message, "used" if newest else "replaced")

    def _take(self, event: SurveyDone | SurfacesBuilt, now_ns: int) -> list[Effect]:
        if isinstance(event, SurfacesBuilt):
            for name in event.job.keyframes:
                self._views.pop(name.robot, None)
        return [*self._surveys.take(event, now_ns)]

    def _locate(self, robot: Robot, pose: Pose, time_ns: int, boot: str) -> bool:
        newest = robot.locate(pose, time_ns, boot)
        if newest:
            self._surveys.forecasts.moved(robot.id)
            if robot.status is not Status.GONE:
                self._place(robot)
        return newest

    def _place(self, robot: Robot) -> None:
        """Let a robot with a pose take part in the groups, with all that is known of its pairs."""
        if robot.fix is None:
            return
        newcomer = robot.id not in self._groups
        self._groups.place(robot.id, robot.fix.pose.centre_m)
        if newcomer:
            self._outside = None
            self._surveys.neighbourhoods.place(robot.id)

    def _tick(self, now_ns: int) -> list[Effect]:
        """Every part of it, whatever becomes of the others: what is under way must get to the workers."""
        effects: list[Effect] = []
        failures: list[Exception] = []
        start, extract = self._surveys.start, lambda _: self._keyframes.start()
        for part in (self._look_around, self._expire, self._judge, extract, start, self._look, self._regroup):
            try:
                effects += part(now_ns)
            except Exception as error:  # noqa: BLE001 - raised below
                failures.append(error)
        if effects or failures:
            self._snapshot = None
        if failures:
            raise InterruptedTickError(self._timeline.told(effects)) from failures[0]
        return effects

    def _expire(self, now_ns: int) -> list[Effect]:
        expired = self._pairs.expire(now_ns)
        for pair in expired:
            self._groups.see(pair, None)
        if self._surveys.neighbourhoods.expire(now_ns) or expired:
            self._snapshot = None
        return []

    def _judge(self, now_ns: int) -> list[Effect]:
        for robot in self._keyframes.due(now_ns):
            self._touch(robot)
        judged = self._surveys.judge(now_ns)
        for robot in judged:
            self._views.pop(robot, None)
        if judged:
            self._snapshot = None
        return []

    def _look(self, now_ns: int) -> list[Effect]:
        if self._surveys.forecasts.look(now_ns):
            self._snapshot = None
        return []

    def _look_around(self, now_ns: int) -> list[Effect]:
        return [self._become(robot, status, now_ns) for robot, status in self._presence.changes(self._names(), now_ns)]

    def _become(self, robot: Robot, status: Status | None, now_ns: int) -> Happened:
        """A robot's presence is another from now on; None: it is forgotten."""
        if status is None:
            return self._forgotten(robot.id, now_ns)
        robot.status = status
        self._outside = None
        self._views.pop(robot.id, None)
        if status is Status.GONE:
            self._groups.withdraw(robot.id)
        elif robot.id not in self._groups:
            self._place(robot)
        return Happened(EventKind.STATUS, now_ns, f"{robot.id} is {status}", (robot.id,))

    def _regroup(self, now_ns: int) -> list[Effect]:
        before = self._groups.view, self._groups.similarity
        seen = self._surveys.seen() if self._groups.may_evaluate(now_ns) else ()
        wall_ns = self._timeline.wall_ns(now_ns)
        effects = self._groups.evaluate(self._ungrouped(), now_ns, wall_ns, at_once=bool(seen))
        if (self._groups.view, self._groups.similarity) != before:
            self._snapshot = None
        for effect in effects:
            if isinstance(effect, GroupsChanged):
                for robot in effect.robots:
                    self._views.pop(robot, None)
        if seen:
            effects.append(GroupsEvaluated(seen))
        return effects

    def _ungrouped(self) -> Ungrouped:
        if self._outside is not None:
            return self._outside
        outside: Ungrouped = tuple(
            (robot, "gone" if self._roster[robot].status is Status.GONE else "no_pose")
            for robot in self._names()
            if robot not in self._groups
        )
        self._outside = outside
        return outside

    def _names(self) -> list[str]:
        """All robots, sorted."""
        if self._sorted is None:
            self._sorted = sorted(robot.id for robot in self._roster)
        return self._sorted

    def _forget(self, robot: str) -> None:
        self._groups.withdraw(robot)
        self._surveys.forget(robot)
        self._keyframes.forget(robot)
        self._roster.forget(robot)
        self._views.pop(robot, None)
        self._snapshot = self._sorted = self._outside = None

    def _touch(self, robot: str) -> Robot:
        if robot not in self._roster:
            self._sorted = self._outside = None
        self._views.pop(robot, None)
        self._presence.heard(robot)
        return self._roster.meet(robot)

    def _view(self, robot: Robot) -> RobotView:
        correction, judged = self._surveys.correction(robot.id), self._surveys.neighbourhoods[robot.id]
        return RobotView.of(robot, self._groups.label_of(robot.id), correction, judged)
