"""Whatever comes on whatever key, up to the station: each message has one fate, and nothing is kept of it at the end.

A script is bytes: records of a head (who, on which key, what happens meanwhile), two bytes of length, and a payload.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import zenoh
from covista_schemas import codec
from covista_schemas.keys import RobotTopic
from covista_service.link.inbox import Inbox
from covista_service.link.ingest import WRONG_KEY, _Opener, _Tokens
from covista_service.link.mailbox import MAX_BYTES, OVERFLOW, TOO_MANY_ROBOTS, UNKNOWN_ROBOT, Depths, Mailboxes
from covista_service.perception.camera import Features
from covista_service.station.events import (
    BuildSurfaces,
    Effect,
    Event,
    ExtractFeatures,
    FeaturesExtracted,
    MessageDropped,
    SurfacesBuilt,
    SurveyDone,
    SurveyPair,
    Tick,
)
from covista_service.station.ledger import FORGOTTEN
from covista_service.station.options import StationOptions
from covista_service.station.station import Station

from tests.fuzz.codec_law import check_text

S = 1_000_000_000
START_NS = 1_700_000_000 * S
SITE = "default"
# Some that robots publish on, and some that only look like it.
ROBOTS = ("r1", "r2", "r3", "R1", "", "r" * 64, "r4", "r5")
REASONS = frozenset((*codec.CODES, OVERFLOW, FORGOTTEN))
AWAY = frozenset((WRONG_KEY, TOO_MANY_ROBOTS, UNKNOWN_ROBOT))
# Fewer than there are robots, even twice of them.
MAX_ROBOTS = 2
# Until robots with nothing to say are gone and forgotten.
_LONG_S = 1000
_FEATURES = Features("rootsift", np.zeros((9, 2), np.float32), np.zeros((9, 128), np.uint8))


class Record(NamedTuple):
    """A message on a key. `pause_ns` passes before it; `turn`: the loop comes after it; `appears`: if it is a token."""

    key: str
    payload: bytes
    pause_ns: int = 0
    turn: bool = False
    appears: bool = True


def records(script: bytes) -> Iterator[Record]:
    """Take a script apart; whatever bytes are one."""
    for head, payload in parts(script):
        pause_ns = 60_000_000 if head & 0x40 else 0
        yield Record(_key(head, payload), payload, pause_ns, bool(head & 0x80), head & 7 != 6)


def parts(script: bytes) -> Iterator[tuple[int, bytes]]:
    """Heads and payloads of a script."""
    at = 0
    while at + 3 <= len(script):
        size = int.from_bytes(script[at + 1 : at + 3], "little")
        yield script[at], script[at + 3 : at + 3 + size]
        at += 3 + size


def script_of(messages: list[tuple[int, bytes]]) -> bytes:
    """The script of heads and payloads."""
    return b"".join(bytes([head]) + len(payload).to_bytes(2, "little") + payload for head, payload in messages)


def _key(head: int, payload: bytes) -> str:
    robot = ROBOTS[(head >> 3 & 7) % len(ROBOTS)]
    kind = head & 7
    if kind == 7:
        return payload[:200].decode("utf-8", "replace")
    if kind in (5, 6):
        # Tokens, that appear or vanish: their boot is the payload.
        return f"covista/{SITE}/robots/{robot}/alive/{payload[:70].decode('latin-1')}"
    return f"covista/{SITE}/robots/{robot}/{'keyframe' if kind & 1 else 'pose'}"


@dataclass
class _Payload:
    """As zenoh's: it has a length, and gives its bytes away once."""

    data: bytes

    def __len__(self) -> int:
        return len(self.data)

    def to_bytes(self) -> bytes:
        return self.data


class Line:
    """From the keys to the station, without the air between: hands answer at once, and find nothing."""

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        self.now_ns = START_NS
        self.station = Station(StationOptions(regroup_after_s=0.0))
        self.boxes = Mailboxes(max_robots=MAX_ROBOTS, max_bytes=max_bytes)
        self._inbox = Inbox(self.boxes)
        self._openers = {topic: _Opener(topic, self.boxes, self._clock) for topic in ("keyframe", "pose")}
        self._presence = _Tokens(self.boxes, self._clock)
        self.messages = 0
        self._tokens_away = 0
        self._tokens: dict[str, None] = {}
        self._images = 0

    def _clock(self) -> int:
        return self.now_ns

    def take(self, record: Record) -> None:
        """Let a message come in on the subscription that its key belongs to; on none, it is let in all the same."""
        self.now_ns += record.pause_ns
        payload = _Payload(record.payload)
        chunks = record.key.split("/")
        topic = chunks[4] if len(chunks) > 4 else ""
        if topic == RobotTopic.ALIVE:
            self._token(record.key, record.appears)
        else:
            topic = topic if topic in self._openers else "pose"
            self.messages += 1
            self._openers[topic].open(SimpleNamespace(key_expr=record.key, payload=payload))
        depths = self.boxes.depths()
        assert depths.robots <= 2 * MAX_ROBOTS
        assert depths.payload_bytes <= self.boxes._max_bytes
        if record.turn:
            self.turn()

    def _token(self, key: str, appears: bool) -> None:
        self._tokens[key] = None
        kind = zenoh.SampleKind.PUT if appears else zenoh.SampleKind.DELETE
        away = self._away()
        self._presence.take(SimpleNamespace(key_expr=key, kind=kind))
        self._tokens_away += self._away() - away

    def _away(self) -> int:
        return sum(self.boxes.turned_away.values())

    def turn(self) -> None:
        """The loop comes: the station hears what waits, and all it wants is done."""
        events, _ = self._inbox.drain(100, self.now_ns)
        for event in events:
            check_event(event)
            self._receive(event)

    def end(self) -> None:
        """Nothing comes any more: everything that came is on an account, and then nobody is known any more."""
        for key in list(self._tokens):
            self._token(key, appears=False)
            self.rest()
        self.rest()
        assert self.boxes.depths() == Depths(0, 0, 0)
        self._check_accounts()
        self.check_forgotten()

    def rest(self) -> None:
        """Let everybody have had a turn."""
        self.now_ns += S
        self.turn()
        self._receive(Tick())

    def _check_accounts(self) -> None:
        accounts, away = self.station.census().accounts, self.boxes.turned_away
        assert set(away) <= AWAY
        for counts in accounts.values():
            assert set(counts.dropped) <= REASONS, counts
            assert counts.waiting == 0, counts
            fates = counts.used + counts.replaced + counts.duplicate + sum(counts.dropped.values())
            assert counts.received == fates, counts
        received = sum(counts.received for counts in accounts.values())
        assert self.messages == received + self._away() - self._tokens_away, (accounts, away, self._tokens_away)

    def check_forgotten(self) -> None:
        for _ in range(3):
            self.now_ns += _LONG_S * S
            self._receive(Tick())
        assert self.station.snapshot(self.now_ns).robots == {}
        assert len(self.station._pairs) == 0
        assert self.station.census().workload.under_way == 0
        assert len(self.boxes._places._heard_ns) <= MAX_ROBOTS

    def _receive(self, event: Event) -> None:
        todo = self.station.receive(event, self.now_ns)
        while todo:
            todo = [more for effect in todo for more in self._done(effect)]

    def _done(self, effect: Effect) -> list[Effect]:
        """A worker is back; of images every third cannot be used."""
        if isinstance(effect, ExtractFeatures):
            self._images += 1
            bad = self._images % 3 == 0
            name, found = effect.keyframe.id, None if bad else _FEATURES
            answer: Event = FeaturesExtracted(name, found, code=codec.BAD_IMAGE if bad else "", problem="bad" * bad)
        elif isinstance(effect, SurveyPair):
            answer = SurveyDone(effect.first, effect.second, None, "none")
        elif isinstance(effect, BuildSurfaces):
            answer = SurfacesBuilt(effect, None, problem="none")
        else:
            return []
        return self.station.receive(answer, self.now_ns)


def check_script(script: bytes) -> int:
    """Raise AssertionError, or whatever comes through; how many messages it was."""
    line, count = Line(), 0
    for record in records(script):
        line.take(record)
        count += 1
    line.end()
    return count


def check_event(event: Event) -> None:
    """What is dropped is dropped for a reason that is known, in one line; a fault of the station's own is none."""
    if isinstance(event, MessageDropped):
        assert event.code in REASONS, event
        check_text(event.text)
