"""What a mailbox has no place for: compact, and counted to the last message."""

import random
from collections.abc import Iterator

import pytest
from covista_service.link import mailbox, surplus
from covista_service.link.inbox import Inbox
from covista_service.link.mailbox import Letter, Mailboxes
from covista_service.link.surplus import Surplus
from covista_service.station.events import Topic
from covista_service.station.ledger import Counts, Run
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.scenes import Scene
from tests.service.wall import keyframe_bytes, pose_bytes

# Of a robot in one boot, as they are sent.
COUNT = 60


def test_numbers_in_a_row_are_one_run_and_gaps_part_them() -> None:
    given_up = Surplus()
    assert not given_up
    for boot, number in (("b0", 5), ("b0", 6), ("b1", 0), ("b0", 7), ("b0", 9), ("b0", 9)):
        assert given_up.add((boot, number))
    assert given_up.runs() == (Run("b0", 5, 8, 3), Run("b1", 0, 1, 1), Run("b0", 9, 10, 1), Run("b0", 9, 10, 1))
    assert (given_up.count, bool(given_up)) == (6, True)


def test_runs_without_end_take_no_more_room_and_stay_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surplus, "MAX_RUNS", 3)
    given_up = Surplus()
    for number in range(100):
        assert given_up.add(("b0", 2 * number))
    assert given_up.runs() == (Run("b0", 0, 1, 1), Run("b0", 2, 3, 1), Run("b0", 4, 199, 98))
    assert not given_up.add(("b1", 0))
    assert given_up.count == 100


def accounts(scene: Scene, robot: str, topic: Topic) -> Counts:
    view = scene.snapshot.robots[robot]
    return view.keyframes if topic == "keyframe" else view.poses


def letters(topic: Topic, arrivals: list[int]) -> Iterator[Letter]:
    write = keyframe_bytes if topic == "keyframe" else pose_bytes
    for number in arrivals:
        yield Letter("r1", topic, "b0", number, write("r1", sequence=number), 0)


@given(
    topic=st.sampled_from(["keyframe", "pose"]),
    kind=st.sampled_from(["names", "bytes", "both"]),
    few_runs=st.booleans(),
    lost=st.sets(st.integers(0, COUNT - 2)),
    seed=st.integers(0, 100),
    repeated=st.lists(st.integers(0, COUNT - 1), max_size=5),
    turns=st.lists(st.integers(1, 30), min_size=1, max_size=4),
)
@settings(deadline=None, max_examples=60)
def test_from_mailbox_to_ledger_every_message_is_counted_once(
    topic: Topic, kind: str, few_runs: bool, lost: set[int], seed: int, repeated: list[int], turns: list[int]
) -> None:
    """With few runs some numbers are no longer told apart, so nothing is repeated and all is in order then."""
    sent = [number for number in range(COUNT) if number not in lost]
    again = [] if few_runs else [number for number in repeated if number not in lost]
    arrivals = [*sent, *again]
    if not few_runs:
        random.Random(seed).shuffle(arrivals)
    scene = Scene()
    size = len(next(letters(topic, [0])).data)
    with pytest.MonkeyPatch.context() as patch:
        if kind != "bytes":
            patch.setattr(mailbox, "MAX_NAMES", 4)
        if few_runs:
            patch.setattr(surplus, "MAX_RUNS", 2)
        boxes = Mailboxes(max_bytes=2**30 if kind == "names" else size + 1)
        if kind != "names":
            # Another robot's message leaves no room, until the first turn.
            boxes.put(Letter("r2", "pose", "b0", 0, bytes(size), 0))
        inbox, turn = Inbox(boxes), 0
        for at, letter in enumerate(letters(topic, arrivals)):
            boxes.put(letter)
            if at % turns[turn % len(turns)] == 0 and at:
                turn += 1
                hear(scene, inbox)
        hear(scene, inbox)
    counts = accounts(scene, "r1", topic)
    assert counts.received == len(arrivals)
    assert len(again) + COUNT == counts.received + counts.missing
    decided = counts.used + counts.replaced + counts.duplicate + sum(counts.dropped.values())
    assert counts.received == decided + counts.waiting
    assert counts.duplicate == len(again)


def hear(scene: Scene, inbox: Inbox) -> None:
    """Let the station have a turn."""
    scene.now_ns += 10**9
    events, _ = inbox.drain(10, scene.now_ns)
    scene.receive(*events)
