"""Who is there: presence, poses and keyframes of every robot."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from covista_schemas.reports import Status

from covista_service.perception.camera import Pose
from covista_service.station.events import Keyframe, KeyframeId, Topic
from covista_service.station.ledger import Counts, Ledger, Total
from covista_service.station.memory import RememberedRobot
from covista_service.station.options import StationOptions, nanoseconds
from covista_service.station.reach import Depth
from covista_service.station.recollection import Recollection

_PAST_BOOTS = 16
# A robot's clock that falls back by more than this was set; by less, the message is late.
_CLOCK_SET_NS = nanoseconds(10)
# When the current boot has been silent for so long, an earlier one that still sends is heard again.
_BOOT_SILENT_NS = nanoseconds(5)


@dataclass(frozen=True, slots=True, eq=False)
class Fix:
    """The newest pose of a robot, from a keyframe or a pose message; `time_ns` is sensor time."""

    pose: Pose
    time_ns: int
    boot: str


@dataclass(slots=True, eq=False)
class Robot:
    """One robot, as far as the station has heard of it.

    `announced` names the newest keyframe that came, usable or not; `arrived` is the newest usable one, `keyframe` the
    newest with features, which is in use; `remembered` was in use before this station started, and has no features any
    more. `last_seen_ns` is wall time. Until `awaited_until_ns` a silent robot is not said to be gone.
    """

    id: str
    status: Status | None = None
    tokens: set[str] = field(default_factory=set)
    sign_of_life_ns: int = 0
    heard_ns: int = 0
    last_seen_ns: int | None = None
    clock_offset_ns: int | None = None
    boot: str | None = None
    boot_heard_ns: int = 0
    past_boots: deque[str] = field(default_factory=lambda: deque(maxlen=_PAST_BOOTS))
    fix: Fix | None = None
    pose_sequence: int = -1
    announced: KeyframeId | None = None
    arrived: Keyframe | None = None
    keyframe: Keyframe | None = None
    remembered: Keyframe | None = None
    awaited_until_ns: int = 0
    depth: Depth | None = None
    last_problem: str | None = None
    ledgers: dict[Topic, Ledger] = field(default_factory=lambda: {"keyframe": Ledger(), "pose": Ledger()})

    @classmethod
    def of(cls, known: RememberedRobot, keyframe: Keyframe | None) -> Robot:
        """A robot as it was last, by the station before."""
        seen_ns = known.last_seen_ns
        return cls(
            known.id,
            sign_of_life_ns=seen_ns,
            heard_ns=seen_ns,
            last_seen_ns=seen_ns,
            boot=known.boot,
            boot_heard_ns=seen_ns,
            fix=None if known.pose is None else Fix(known.pose, known.pose_time_ns, known.boot or ""),
            arrived=keyframe,
            remembered=keyframe,
        )

    def enters(self, boot: str, arrived_ns: int) -> bool:
        """Take the boot of a message for the current one; True if it is current now.

        One that was superseded comes back only if the current one is over: a second sender under the same id, such as
        a keyframe sent by hand, must not shut out the robot for good.
        """
        if boot != self.boot:
            if boot in self.past_boots:
                if not self._is_over(boot, arrived_ns):
                    self.last_problem = f"boot {boot} sends beside boot {self.boot}: do two robots share this id?"
                    return False
                self.past_boots.remove(boot)
            if self.boot is not None:
                self.past_boots.append(self.boot)
            self.boot = boot
            self.pose_sequence = -1
        self.boot_heard_ns = max(arrived_ns, self.boot_heard_ns)
        return True

    def _is_over(self, boot: str, now_ns: int) -> bool:
        """Is the current boot silent, and without a token that the other `boot` does not have?"""
        alone = self.boot in self.tokens and boot not in self.tokens
        return now_ns - self.boot_heard_ns >= _BOOT_SILENT_NS and not alone

    def locate(self, pose: Pose, time_ns: int, boot: str) -> bool:
        """Take a pose for the newest if it is, by sensor time within one boot."""
        held = self.fix
        late_ns = 0 if held is None or held.boot != boot else held.time_ns - time_ns
        if 0 < late_ns <= _CLOCK_SET_NS:
            return False
        self.fix = Fix(pose, time_ns, boot)
        return True

    def announce(self, messages: Iterable[tuple[str, int]]) -> None:
        """Note the names of keyframes, in order of arrival."""
        for boot, sequence in messages:
            newest = self.announced
            if newest is None or newest.boot != boot or newest.sequence < sequence:
                self.announced = KeyframeId(self.id, boot, sequence)

    def heard(self, arrived_ns: int, time_ns: int | None, wall_ns: int) -> None:
        """Note a message: presence by its arrival, the offset of the robot's clock by sensor time and wall time."""
        if arrived_ns >= self.heard_ns:
            self.heard_ns, self.last_seen_ns = arrived_ns, wall_ns
        self.sign_of_life_ns = max(arrived_ns, self.sign_of_life_ns)
        if time_ns is not None:
            self.clock_offset_ns = time_ns - wall_ns


class Roster:
    """All robots by id. Presence is a function of the last sign of life and of the time asked for."""

    def __init__(self, options: StationOptions) -> None:
        self._stale_after_ns = nanoseconds(options.live_after_s)
        self._gone_after_ns = nanoseconds(options.live_after_s + options.gone_after_s)
        self._forget_after_ns = nanoseconds(options.forget_after_s)
        self._robots: dict[str, Robot] = {}
        self._forgotten: dict[Topic, Total] = {"keyframe": Total(), "pose": Total()}
        # Tokens of robots that were forgotten though they live: they are not told again when those come back.
        self._tokens: dict[str, set[str]] = {}

    def accounts(self) -> dict[Topic, Counts]:
        """The accounts of all robots by topic, those that are forgotten included."""
        totals = {topic: total.copy() for topic, total in self._forgotten.items()}
        for robot in self._robots.values():
            for topic, ledger in robot.ledgers.items():
                ledger.add_to(totals[topic])
        return {topic: total.counts() for topic, total in totals.items()}

    def __iter__(self) -> Iterator[Robot]:
        return iter(self._robots.values())

    def __contains__(self, robot: object) -> bool:
        return robot in self._robots

    def __getitem__(self, robot: str) -> Robot:
        return self._robots[robot]

    def get(self, robot: str) -> Robot | None:
        """A robot, if it is known."""
        return self._robots.get(robot)

    def meet(self, robot: str) -> Robot:
        """A robot, known from now on."""
        if robot not in self._robots:
            self._robots[robot] = Robot(robot, tokens=self._tokens.pop(robot, set()))
        return self._robots[robot]

    def restore(self, known: Recollection, now_ns: int) -> None:
        """Take up robots as they were last, their accounts anew.

        Nobody listened while there was no station: who stood in a group and has been silent for too long meanwhile is
        awaited for as long as it takes a robot to be stale.
        """
        standing = frozenset().union(*known.memory.groups.values())
        for remembered in known.memory.robots:
            robot = self._robots[remembered.id] = Robot.of(remembered, known.keyframe(remembered))
            if robot.id in standing:
                robot.awaited_until_ns = now_ns + self._stale_after_ns
            robot.status = self.status(robot, now_ns)

    def forget(self, robot: str) -> None:
        """Drop all that is known of a robot, but for what it adds to the accounts of all."""
        known = self._robots.pop(robot)
        if known.tokens:
            self._tokens[robot] = known.tokens
        for topic, ledger in known.ledgers.items():
            ledger.close()
            ledger.add_to(self._forgotten[topic])

    def token_seen(self, robot: str, boot: str, now_ns: int) -> None:
        """A liveliness token is there."""
        known = self.meet(robot)
        known.tokens.add(boot)
        if known.boot is None:
            known.boot = boot
        known.sign_of_life_ns = now_ns

    def token_lost(self, robot: str, boot: str | None, now_ns: int) -> None:
        """A liveliness token vanished: it counts as a sign of life to the last, so that a bounce is not news."""
        if boot is None:
            self._tokens_lost(robot, now_ns)
            return
        known = self._robots.get(robot)
        if known is not None and boot in known.tokens:
            known.tokens.remove(boot)
            known.sign_of_life_ns = now_ns
        elif known is None and robot in self._tokens:
            self._tokens[robot].discard(boot)
            if not self._tokens[robot]:
                del self._tokens[robot]

    def _tokens_lost(self, robot: str, now_ns: int) -> None:
        """All tokens count as gone: with one too few a robot is present by its messages, with one too many for ever."""
        self._tokens.pop(robot, None)
        known = self._robots.get(robot)
        if known is not None and known.tokens:
            known.tokens.clear()
            known.sign_of_life_ns = now_ns

    def status(self, robot: Robot, now_ns: int) -> Status:
        """Live, stale or gone at `now_ns`."""
        silent_ns = now_ns - robot.sign_of_life_ns
        if robot.tokens or silent_ns < self._stale_after_ns:
            return Status.LIVE
        return Status.STALE if silent_ns < self._gone_after_ns or now_ns < robot.awaited_until_ns else Status.GONE

    def lapsed(self, robot: Robot, now_ns: int) -> bool:
        """Has it been silent for so long that it is to be forgotten?"""
        return not robot.tokens and now_ns - robot.sign_of_life_ns >= self._forget_after_ns
