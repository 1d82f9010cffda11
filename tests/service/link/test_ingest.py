from collections.abc import Iterator

import pytest
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

from tests.service.deadline import wait_until
from tests.service.link.conftest import Air
from tests.service.wall import keyframe_bytes, pose_bytes

SITE = "ingest"


class Heard:
    """All events so far."""

    def __init__(self, mailboxes: Mailboxes) -> None:
        self.mailboxes = mailboxes
        self.events: list[Event] = []

    def of(self, kind: type, count: int = 1) -> list[Event]:
        """Wait until there are so many events of a kind."""

        def look() -> list[Event]:
            self.events += Inbox(self.mailboxes).drain(100)[0]
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
        air.rover.put(keys.pose(SITE, "r1"), pose_bytes("r1", sequence=sequence))

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


def test_a_key_that_names_no_robot_is_counted_on_the_station(air: Air, heard: Heard) -> None:
    air.rover.put(f"covista/{SITE}/robots/Not_An_Id/keyframe", keyframe_bytes("r1"))
    wait_until(lambda: heard.mailboxes.turned_away == {"wrong_key": 1}, "the count")
    assert heard.mailboxes.drain(10) == ([], False)


def test_tokens_are_seen_also_those_from_before_and_lost(air: Air) -> None:
    before = air.rover.liveliness().declare_token(keys.alive(SITE, "r1", "b0"))
    mailboxes = Mailboxes()
    ingest = Ingest(air.station, SITE, mailboxes)
    heard = Heard(mailboxes)
    assert heard.of(TokenSeen) == [TokenSeen("r1", "b0")]
    before.undeclare()
    assert heard.of(TokenLost) == [TokenLost("r1", "b0")]
    ingest.close()


def test_after_the_end_nothing_is_taken_in(air: Air) -> None:
    mailboxes = Mailboxes()
    ingest = Ingest(air.station, "closed", mailboxes)
    ingest.close()
    with air.station.declare_subscriber(keys.pose("closed", "r1")) as witness:
        air.rover.put(keys.pose("closed", "r1"), pose_bytes("r1"))
        witness.recv()
    assert mailboxes.drain(10) == ([], False)
