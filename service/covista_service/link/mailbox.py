"""Where messages wait between zenoh's threads and the loop: bounded, newest wins, every one counted.

A flood costs its sender its own older messages and nobody else anything: robots take turns, each at most once per gap
(`turns.Pace`), and what comes in between is conflated.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from covista_service.link.places import IDLE_NS, TOO_MANY_ROBOTS, UNKNOWN_ROBOT, Places, Word
from covista_service.link.surplus import Surplus
from covista_service.link.turns import Pace, Turns
from covista_service.station.events import Topic
from covista_service.station.ledger import MessageId

__all__ = ["IDLE_NS", "OVERFLOW", "TOO_MANY_ROBOTS", "UNKNOWN_ROBOT", "Depths", "Letter", "Mail", "Mailboxes"]

OVERFLOW = "overflow"
TOO_FAST = "came faster than the station could take it"
MAX_ROBOTS = 4096
# Waiting payloads of all robots, in all.
MAX_BYTES = 256 * 1024 * 1024
# Names of messages, and boots of tokens, that a robot may have waiting; beyond, messages are given up.
MAX_NAMES = 16_384
MAX_TOKENS = 64

Explain = Callable[[], str]
# What a robot stands in line for; in this order its mail is handed over.
Line = Literal["token", "keyframe", "pose", "garbage"]
LINES: tuple[Line, ...] = ("token", "keyframe", "pose", "garbage")
_MS = 1_000_000
# A keyframe costs the loop up to a millisecond, a pose some hundredths to tenths of one.
PACES: Mapping[Line, Pace] = {
    "token": Pace(20 * _MS),
    "keyframe": Pace(50 * _MS),
    "pose": Pace(20 * _MS, per_s=2000, burst=256),
    # To hear twice a second why a robot cannot be understood is enough.
    "garbage": Pace(500 * _MS),
}


# Not frozen, for the sake of twenty thousand a second: freezing would treble what making one costs.
@dataclass(slots=True, eq=False)
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
    """One robot's messages of one topic since the last drain; `kept` stands at `kept_at` among the names."""

    names: list[MessageId] = field(default_factory=list)
    kept: Letter | None = None
    kept_at: int = 0
    refusals: dict[str, Refusal] = field(default_factory=dict)
    surplus: Surplus = field(default_factory=Surplus)
    arrived_ns: int = 0

    def refuse(self, code: str, text: str) -> None:
        """Count a message that has no readable name."""
        refusal = self.refusals.get(code)
        if refusal is None:
            refusal = self.refusals[code] = Refusal(0, text)
        refusal.count += 1

    def give_up(self, name: MessageId) -> None:
        """Count a message that there is no place for."""
        if not self.surplus.add(name):
            self.refuse(OVERFLOW, TOO_FAST)

    def put(self, letter: Letter) -> None:
        """Take a message in; where there is no place for its name, one that is not the newest loses its own."""
        kept = self.kept
        newest = kept is None or kept.boot != letter.boot or kept.sequence < letter.sequence
        if len(self.names) < MAX_NAMES:
            self.names.append(letter.name)
            at = len(self.names) - 1
        elif newest:
            at = self.kept_at
            self.give_up(self.names[at])
            self.names[at] = letter.name
        else:
            self.give_up(letter.name)
        if newest:
            self.kept, self.kept_at = letter, at


@dataclass(slots=True, eq=False)
class Mail:
    """What one robot sent since the last drain; `tokens` says by boot whether its liveliness token is there.

    With `tokens_lost` more of them vanished before than there is place for. What has no readable name is `garbage`,
    and waits by itself: it is in less of a hurry.
    """

    robot: str
    boxes: dict[Topic, Box] = field(default_factory=dict)
    tokens: dict[str, bool] = field(default_factory=dict)
    tokens_lost: bool = False
    garbage: dict[Topic, Box] = field(default_factory=dict)


class Mailboxes:
    """A mailbox per robot. Zenoh's threads put, the loop drains.

    `wake` is called in their threads, once per burst: when something falls due earlier than what the last drain said.
    """

    def __init__(
        self, max_robots: int = MAX_ROBOTS, max_bytes: int = MAX_BYTES, paces: Mapping[Line, Pace] = PACES
    ) -> None:
        self._max_bytes = max_bytes
        self._lock = threading.Lock()
        self._mail: dict[str, Mail] = {}
        self._turns = {line: Turns(paces[line]) for line in LINES}
        self._places = Places(max_robots)
        self._bytes = 0
        self._turned_away: Counter[str] = Counter()
        self._wake: Callable[[], None] = _nobody
        # When the loop comes anyway.
        self._awaited_ns: int | None = None

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
            mail = self._open(letter.robot, letter.arrived_ns, "message")
            sooner = mail is not None and self._put(mail, letter)
        if sooner:
            self._wake()

    def refuse(self, robot: str, topic: Topic, code: str, explain: Explain, arrived_ns: int) -> None:
        """Count a message of a robot that is so broken that its name cannot be read; `explain` says what is wrong."""
        with self._lock:
            if not self._admit(robot, arrived_ns, "garbage") or self._refuse_likewise(robot, topic, code, arrived_ns):
                return
        # Nobody else waits while the first of a burst is put into words.
        text = explain()
        with self._lock:
            mail = self._mail_of(robot)
            sooner = not mail.garbage and self._stand("garbage", robot, arrived_ns)
            box = mail.garbage.setdefault(topic, Box())
            box.arrived_ns = arrived_ns
            box.refuse(code, text)
        if sooner:
            self._wake()

    def token(self, robot: str, boot: str, alive: bool, arrived_ns: int) -> None:
        """Note that a liveliness token appeared or vanished."""
        with self._lock:
            leaves = not alive and robot not in self._places
            mail = self._farewell(robot) if leaves else self._open(robot, arrived_ns, "token")
            sooner = mail is not None and self._token(mail, boot, alive, arrived_ns)
        if sooner:
            self._wake()

    def drain(self, limit: int, now_ns: int) -> tuple[list[Mail], int | None]:
        """The mail of up to `limit` robots of each line whose turn it is, and when to come again; None: when woken.

        Tokens and keyframes go before poses, and who has waited longest goes first.
        """
        with self._lock:
            handed: dict[str, Mail] = {}
            for line, turns in self._turns.items():
                for robot in turns.take(limit, now_ns):
                    self._hand_over(line, self._mail[robot], handed.setdefault(robot, Mail(robot)))
            nexts_ns = [turns.next_ns(now_ns) for turns in self._turns.values()]
            self._awaited_ns = min((next_ns for next_ns in nexts_ns if next_ns is not None), default=None)
            return list(handed.values()), self._awaited_ns

    def _open(self, robot: str, now_ns: int, word: Word) -> Mail | None:
        """The robot's mail, None where there is no place for it."""
        return self._mail_of(robot) if self._admit(robot, now_ns, word) else None

    def _admit(self, robot: str, now_ns: int, word: Word) -> bool:
        reason = self._places.admit(robot, now_ns, word, waiting=self._mail)
        if reason is not None:
            self._turned_away[reason] += 1
        return reason is None

    def _farewell(self, robot: str) -> Mail | None:
        """Mail of a robot whose place was given away, for the end of a token that the station may have heard of."""
        if not self._places.part(robot):
            self._turned_away[TOO_MANY_ROBOTS] += 1
            return None
        return self._mail_of(robot)

    def _mail_of(self, robot: str) -> Mail:
        mail = self._mail.get(robot)
        if mail is None:
            mail = self._mail[robot] = Mail(robot)
        return mail

    def _refuse_likewise(self, robot: str, topic: Topic, code: str, arrived_ns: int) -> bool:
        """Count a message whose fault has been put into words since the last drain; False if it has not."""
        mail = self._mail.get(robot)
        box = mail.garbage.get(topic) if mail is not None else None
        refusal = box.refusals.get(code) if box is not None else None
        if box is None or refusal is None:
            return False
        refusal.count += 1
        box.arrived_ns = arrived_ns
        return True

    def _put(self, mail: Mail, letter: Letter) -> bool:
        box, sooner = self._box(mail, letter.topic, letter.arrived_ns)
        before = _weight(box.kept)
        if self._bytes + len(letter.data) - before > self._max_bytes:
            box.give_up(letter.name)
        else:
            box.put(letter)
            self._bytes += _weight(box.kept) - before
        return sooner

    def _token(self, mail: Mail, boot: str, alive: bool, now_ns: int) -> bool:
        sooner = not mail.tokens and self._stand("token", mail.robot, now_ns)
        if boot in mail.tokens or len(mail.tokens) < MAX_TOKENS:
            # Taken out first, so that the order of the dictionary is that of arrival.
            mail.tokens.pop(boot, None)
            mail.tokens[boot] = alive
        elif not alive:
            mail.tokens_lost = True
        return sooner

    def _box(self, mail: Mail, topic: Topic, arrived_ns: int) -> tuple[Box, bool]:
        """The box of a topic, stamped with an arrival, and whether the loop must be told of it."""
        box = mail.boxes.get(topic)
        sooner = False
        if box is None:
            box = mail.boxes[topic] = Box()
            sooner = self._stand(topic, mail.robot, arrived_ns)
        box.arrived_ns = arrived_ns
        return box, sooner

    def _stand(self, line: Line, robot: str, now_ns: int) -> bool:
        due_ns = self._turns[line].stand(robot, now_ns)
        sooner = self._awaited_ns is None or due_ns < self._awaited_ns
        if sooner:
            self._awaited_ns = due_ns
        return sooner

    def _hand_over(self, line: Line, mail: Mail, handed: Mail) -> None:
        if line == "token":
            handed.tokens, mail.tokens = mail.tokens, {}
            handed.tokens_lost, mail.tokens_lost = mail.tokens_lost, False
        elif line == "garbage":
            handed.garbage, mail.garbage = mail.garbage, {}
        else:
            box = handed.boxes[line] = mail.boxes.pop(line)
            self._bytes -= _weight(box.kept)
        if not mail.boxes and not mail.tokens and not mail.garbage:
            del self._mail[mail.robot]
            self._places.parted(mail.robot)


def _weight(letter: Letter | None) -> int:
    return 0 if letter is None else len(letter.data)


def _nobody() -> None:
    """Nobody to wake yet."""
