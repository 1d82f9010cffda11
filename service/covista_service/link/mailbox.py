"""Where messages wait between zenoh's threads and the loop: bounded, newest wins, every one counted.

A flood costs its sender its own older messages and nobody else anything.
"""

from __future__ import annotations

import threading
from collections import Counter, OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field

from covista_service.station.events import Topic

MessageId = tuple[str, int]
OVERFLOW = "overflow"
TOO_MANY_ROBOTS = "too_many_robots"
MAX_ROBOTS = 4096
# Waiting payloads of all robots, in all.
MAX_BYTES = 256 * 1024 * 1024
# Names of messages, and boots of tokens, that a robot may have waiting; beyond, they are counted only.
MAX_NAMES = 16_384
MAX_TOKENS = 64
# A robot silent for so long gives its place to another when the house is full.
IDLE_NS = 600 * 1_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Letter:
    """A message as it came, its name read and nothing else."""

    robot: str
    topic: Topic
    boot: str
    sequence: int
    data: bytes
    arrived_ns: int

    @property
    def name(self) -> MessageId:
        """(boot, sequence)."""
        return self.boot, self.sequence


@dataclass(frozen=True, slots=True)
class Depths:
    """What waits in all mailboxes: robots with mail, names of messages, and bytes of payload."""

    robots: int
    messages: int
    payload_bytes: int


@dataclass(slots=True)
class Refusal:
    """Messages refused for one reason since the last drain."""

    count: int
    text: str


@dataclass(slots=True, eq=False)
class Box:
    """One robot's messages of one topic since the last drain."""

    names: list[MessageId] = field(default_factory=list)
    kept: Letter | None = None
    refusals: dict[str, Refusal] = field(default_factory=dict)
    arrived_ns: int = 0

    def refuse(self, code: str, text: str) -> None:
        """Count a message that is not even worth a name."""
        refusal = self.refusals.setdefault(code, Refusal(0, text))
        refusal.count += 1
        refusal.text = text


@dataclass(slots=True, eq=False)
class Mail:
    """All that one robot sent since the last drain; `tokens` says by boot whether its liveliness token is there."""

    robot: str
    boxes: dict[Topic, Box] = field(default_factory=dict)
    tokens: dict[str, bool] = field(default_factory=dict)

    def box(self, topic: Topic, arrived_ns: int) -> Box:
        """The box of a topic, stamped with an arrival."""
        box = self.boxes.setdefault(topic, Box())
        box.arrived_ns = arrived_ns
        return box


class Mailboxes:
    """A mailbox per robot. Zenoh's threads put, the loop drains; `wake` is called once per burst, in their threads."""

    def __init__(self, max_robots: int = MAX_ROBOTS, max_bytes: int = MAX_BYTES) -> None:
        self._max_robots = max_robots
        self._max_bytes = max_bytes
        self._lock = threading.Lock()
        self._mail: OrderedDict[str, Mail] = OrderedDict()
        self._last_ns: OrderedDict[str, int] = OrderedDict()
        self._bytes = 0
        self._turned_away: Counter[str] = Counter()
        self._wake: Callable[[], None] = _nobody

    @property
    def turned_away(self) -> dict[str, int]:
        """Messages that are on no robot's account, by reason."""
        with self._lock:
            return dict(self._turned_away)

    def depths(self) -> Depths:
        """What waits now."""
        with self._lock:
            names = sum(len(box.names) for mail in self._mail.values() for box in mail.boxes.values())
            return Depths(len(self._mail), names, self._bytes)

    def turn_away(self, reason: str) -> None:
        """Count a message that names no robot."""
        with self._lock:
            self._turned_away[reason] += 1

    def attach(self, wake: Callable[[], None]) -> None:
        """Say whom to wake when mail comes; what is here already wakes at once."""
        self._wake = wake
        if self._mail:
            wake()

    def put(self, letter: Letter) -> None:
        """Put a message; it replaces what is waiting, unless it is older within the same boot."""
        with self._lock:
            mail, first = self._open(letter.robot, letter.arrived_ns)
            if mail is not None:
                self._put(mail.box(letter.topic, letter.arrived_ns), letter)
        self._ring(first)

    def refuse(self, robot: str, topic: Topic, code: str, text: str, arrived_ns: int) -> None:
        """Count a message of a robot that is so broken that its name cannot be read."""
        with self._lock:
            mail, first = self._open(robot, arrived_ns)
            if mail is not None:
                mail.box(topic, arrived_ns).refuse(code, text)
        self._ring(first)

    def token(self, robot: str, boot: str, alive: bool, arrived_ns: int) -> None:
        """Note that a liveliness token appeared or vanished."""
        with self._lock:
            mail, first = self._open(robot, arrived_ns)
            if mail is not None and (boot in mail.tokens or len(mail.tokens) < MAX_TOKENS):
                # Taken out first, so that the order of the dictionary is that of arrival.
                mail.tokens.pop(boot, None)
                mail.tokens[boot] = alive
        self._ring(first)

    def drain(self, limit: int) -> tuple[list[Mail], bool]:
        """The mail of up to `limit` robots, those first that have waited longest, and whether there is more."""
        with self._lock:
            mail = [self._mail.popitem(last=False)[1] for _ in range(min(limit, len(self._mail)))]
            self._bytes -= sum(_weight(box.kept) for each in mail for box in each.boxes.values())
            return mail, bool(self._mail)

    def _open(self, robot: str, now_ns: int) -> tuple[Mail | None, bool]:
        """The robot's mail, None where there is no place for it, and whether it is the first of a burst."""
        if robot not in self._last_ns and len(self._last_ns) >= self._max_robots:
            idle, last_ns = next(iter(self._last_ns.items()))
            if idle in self._mail or now_ns - last_ns < IDLE_NS:
                self._turned_away[TOO_MANY_ROBOTS] += 1
                return None, False
            del self._last_ns[idle]
        self._last_ns[robot] = now_ns
        self._last_ns.move_to_end(robot)
        first = not self._mail
        return self._mail.setdefault(robot, Mail(robot)), first

    def _put(self, box: Box, letter: Letter) -> None:
        more = len(letter.data) - _weight(box.kept)
        if len(box.names) >= MAX_NAMES or self._bytes + more > self._max_bytes:
            box.refuse(OVERFLOW, "came faster than the station could take it")
            return
        box.names.append(letter.name)
        kept = box.kept
        if kept is None or kept.boot != letter.boot or kept.sequence < letter.sequence:
            box.kept = letter
            self._bytes += more

    def _ring(self, first: bool) -> None:
        if first:
            self._wake()


def _weight(letter: Letter | None) -> int:
    return 0 if letter is None else len(letter.data)


def _nobody() -> None:
    """Nobody to wake yet."""
