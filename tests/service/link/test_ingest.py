import threading
import time
from collections import Counter
from collections.abc import Iterator

import pytest
import zenoh
from covista_schemas import codec, keys
from covista_service.link.inbox import Inbox
from covista_service.link.ingest import Ingest
from covista_service.link.mailbox import Mailboxes
from covista_service.station.events import (
    Event,
    KeyframeArrived,
    MessageDropped,
    MessagesReceived,
    PoseArrived,
    TokenLost,
    TokenSeen,
)
from covista_service.station.ledger import Ledger

from tests.service.deadline import wait_until
from tests.service.link.conftest import Air
from tests.service.wall import keyframe_bytes, pose_bytes

SITE = "ingest"
# Zenoh drops what it has no room for, unless told otherwise.
BLOCK = zenoh.CongestionControl.BLOCK


class Heard:
    """All events so far."""

    def __init__(self, mailboxes: Mailboxes) -> None:
        self.mailboxes = mailboxes
        self.events: list[Event] = []

    def fresh(self) -> list[Event]:
        """Events since the last look."""
        return list(Inbox(self.mailboxes).drain(100, time.time_ns())[0])

    def of(self, kind: type, count: int = 1) -> list[Event]:
        """Wait until there are so many events of a kind."""

        def look() -> list[Event]:
            self.events += self.fresh()
            found = [event for event in self.events if isinstance(event, kind)]
            return found if len(found) >= count else []

        return wait_until(look, f"{count} {kind.__name__}")


@pytest.fixture
def heard(air: Air) -> Iterator[Heard]:
    mailboxes = Mailboxes()
    ingest = Ingest(air.station, SITE, mailboxes, clock=lambda: 42)
    yield Heard(mailboxes)
    ingest.close()


def test_keyframes_and_poses_come_in_with_their_arrival(air: Air, heard: Heard) -> None:
    air.rover.put(keys.keyframe(SITE, "r1"), keyframe_bytes("r1", sequence=4))
    air.rover.put(keys.pose(SITE, "r1"), pose_bytes("r1"))
    (keyframe,) = heard.of(KeyframeArrived)
    (pose,) = heard.of(PoseArrived)
    assert isinstance(keyframe, KeyframeArrived)
    assert isinstance(pose, PoseArrived)
    assert keyframe.keyframe.id.sequence == 4
    assert keyframe.keyframe.arrived_ns == pose.arrived_ns == 42


def test_every_message_of_a_burst_is_named_once(air: Air, heard: Heard) -> None:
    for sequence in range(300):
        air.rover.put(keys.pose(SITE, "r1"), pose_bytes("r1", sequence=sequence), congestion_control=BLOCK)

    def named() -> list[tuple[str, int]]:
        received = [event for event in heard.of(MessagesReceived) if isinstance(event, MessagesReceived)]
        return [name for event in received for name in event.sequences]

    wait_until(lambda: len(named()) == 300, "300 names")
    assert named() == [("b0", sequence) for sequence in range(300)]


@pytest.mark.parametrize(
    ("payload", "code"),
    [
        (b"\xff\xff\xff garbage", codec.MALFORMED),
        (b"", codec.WRONG_ID),
        (keyframe_bytes("r2"), codec.WRONG_ID),
        (keyframe_bytes("r1", boot="Boot!"), codec.WRONG_ID),
    ],
)
def test_what_has_no_readable_name_is_counted_on_the_robot_of_the_key(
    air: Air, heard: Heard, payload: bytes, code: str
) -> None:
    air.rover.put(keys.keyframe(SITE, "r1"), payload)
    (dropped,) = heard.of(MessageDropped)
    assert isinstance(dropped, MessageDropped)
    assert (dropped.robot, dropped.topic, dropped.code, dropped.counted) == ("r1", "keyframe", code, False)


def test_beside_a_busy_thread_a_flood_is_named_to_the_last_message(air: Air, heard: Heard) -> None:
    """A callback per message would wait for the interpreter each time: some hundreds would come through a second."""
    count, over = 10_000, threading.Event()
    busy = threading.Thread(target=lambda: [sum(range(1000)) for _ in iter(over.is_set, True)])
    busy.start()
    publisher = air.rover.declare_publisher(
        keys.pose(SITE, "r1"), congestion_control=BLOCK, encoding=codec.POSE_ENCODING
    )
    try:
        for sequence in range(count):
            publisher.put(pose_bytes("r1", sequence=sequence))
        ledger = Ledger()

        def accounted() -> bool:
            for event in heard.fresh():
                if isinstance(event, MessagesReceived):
                    ledger.hear(event.sequences, event.kept)
            return ledger.counts().received == count

        wait_until(accounted, "all poses")
    finally:
        over.set()
        busy.join()
        publisher.undeclare()
    counts = ledger.counts()
    assert counts.missing == counts.duplicate == 0
    assert counts.replaced + counts.waiting == count


def test_a_flood_of_garbage_is_counted_by_reason_and_the_robot_s_own_come_through(air: Air, heard: Heard) -> None:
    kinds = (b"\xff\xff garbage", pose_bytes("r2"), pose_bytes("r1") + b"\xfa\x3e\xff\x7f" + bytes(16_383))
    for turn in range(100):
        for payload in kinds:
            air.rover.put(keys.pose(SITE, "r1"), payload, congestion_control=BLOCK)
        air.rover.put(keys.pose(SITE, "r1"), pose_bytes("r1", sequence=turn), congestion_control=BLOCK)
    dropped: Counter[str] = Counter()
    heard_of: set[int] = set()

    def all_counted() -> bool:
        for event in heard.fresh():
            if isinstance(event, MessageDropped):
                dropped[event.code] += event.count
                assert event.text
            elif isinstance(event, MessagesReceived):
                heard_of.update(number for _, number in event.sequences)
        return len(heard_of) == 100 and dropped.total() == 300

    wait_until(all_counted, "all counted")
    assert dropped == {codec.MALFORMED: 100, codec.WRONG_ID: 100, codec.TOO_LARGE: 100}


def test_a_bug_that_one_message_brings_to_light_costs_that_message_alone(
    air: Air, heard: Heard, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr(heard.mailboxes, "put", lambda letter: 1 / 0)
        air.rover.put(keys.pose(SITE, "r1"), pose_bytes("r1"))
        wait_until(lambda: "ZeroDivisionError" in caplog.text)
    air.rover.put(keys.pose(SITE, "r1"), pose_bytes("r1", sequence=1))
    (pose,) = heard.of(PoseArrived)
    assert isinstance(pose, PoseArrived)
    assert pose.sequence == 1


def test_closing_ends_its_threads_and_can_be_done_in_the_middle_of_a_flood(air: Air) -> None:
    mailboxes = Mailboxes()
    ingest = Ingest(air.station, "flood", mailboxes)
    for sequence in range(3000):
        air.rover.put(keys.pose("flood", "r1"), pose_bytes("r1", sequence=sequence))
    ingest.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("covista-pose")]


def test_a_key_that_names_no_robot_is_counted_on_the_station(air: Air, heard: Heard) -> None:
    air.rover.put(f"covista/{SITE}/robots/Not_An_Id/keyframe", keyframe_bytes("r1"))
    wait_until(lambda: heard.mailboxes.turned_away == {"wrong_key": 1}, "the count")
    assert heard.mailboxes.drain(10, time.time_ns()) == ([], None)


def test_tokens_are_seen_also_those_from_before_and_lost(air: Air) -> None:
    before = air.rover.liveliness().declare_token(keys.alive(SITE, "r1", "b0"))
    mailboxes = Mailboxes()
    ingest = Ingest(air.station, SITE, mailboxes)
    heard = Heard(mailboxes)
    assert heard.of(TokenSeen) == [TokenSeen("r1", "b0")]
    before.undeclare()
    assert heard.of(TokenLost) == [TokenLost("r1", "b0")]
    ingest.close()


def test_tokens_are_lost_with_the_session_and_seen_again_with_the_next(air: Air) -> None:
    token = air.rover.liveliness().declare_token(keys.alive("parting", "r1", "b0"))
    mailboxes = Mailboxes()
    heard = Heard(mailboxes)
    for round_number in (1, 2):
        ingest = Ingest(air.station, "parting", mailboxes)
        assert len(heard.of(TokenSeen, round_number)) == round_number
        assert ingest.alive == {"r1"}
        ingest.part()
        assert heard.of(TokenLost, round_number) == [TokenLost("r1", "b0")] * round_number
        assert not ingest.alive
    token.undeclare()


def test_after_the_end_nothing_is_taken_in(air: Air) -> None:
    mailboxes = Mailboxes()
    ingest = Ingest(air.station, "closed", mailboxes)
    ingest.close()
    with air.station.declare_subscriber(keys.pose("closed", "r1")) as witness:
        air.rover.put(keys.pose("closed", "r1"), pose_bytes("r1"))
        witness.recv()
    assert mailboxes.drain(10, time.time_ns()) == ([], None)
