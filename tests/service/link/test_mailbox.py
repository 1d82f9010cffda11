from threading import Thread

import pytest
from covista_service.link import mailbox
from covista_service.link.mailbox import IDLE_NS, Depths, Letter, Mailboxes
from covista_service.station.events import Topic


def letter(
    robot: str = "r1", sequence: int = 0, *, boot: str = "b0", topic: Topic = "keyframe", size: int = 1
) -> Letter:
    return Letter(robot, topic, boot, sequence, b"x" * size, sequence)


def test_the_newest_wins_and_every_message_keeps_its_name() -> None:
    boxes = Mailboxes()
    for sequence in (0, 1, 2):
        boxes.put(letter(sequence=sequence))
    (mail,), more = boxes.drain(10)
    box = mail.boxes["keyframe"]
    assert box.kept is not None
    assert (box.kept.sequence, box.names, more) == (2, [("b0", 0), ("b0", 1), ("b0", 2)], False)
    assert boxes.drain(10) == ([], False)


def test_a_message_that_overtook_another_is_kept() -> None:
    boxes = Mailboxes()
    boxes.put(letter(sequence=5))
    boxes.put(letter(sequence=4))
    (mail,), _ = boxes.drain(10)
    assert mail.boxes["keyframe"].kept is not None
    assert mail.boxes["keyframe"].kept.sequence == 5


def test_a_new_boot_starts_from_zero_and_wins() -> None:
    boxes = Mailboxes()
    boxes.put(letter(sequence=70, boot="old"))
    boxes.put(letter(sequence=0, boot="new"))
    (mail,), _ = boxes.drain(10)
    assert mail.boxes["keyframe"].kept is not None
    assert mail.boxes["keyframe"].kept.name == ("new", 0)


def test_topics_do_not_replace_each_other() -> None:
    boxes = Mailboxes()
    boxes.put(letter(sequence=3))
    boxes.put(letter(sequence=9, topic="pose"))
    (mail,), _ = boxes.drain(10)
    assert {topic: box.names for topic, box in mail.boxes.items()} == {"keyframe": [("b0", 3)], "pose": [("b0", 9)]}


def test_a_flood_of_one_robot_leaves_the_others_their_turn() -> None:
    boxes = Mailboxes()
    for sequence in range(1000):
        boxes.put(letter("noisy", sequence))
    boxes.put(letter("r2"))
    boxes.put(letter("r3"))
    first, more = boxes.drain(2)
    assert [mail.robot for mail in first] == ["noisy", "r2"]
    assert more
    boxes.put(letter("noisy", 1000))
    second, more = boxes.drain(2)
    assert [mail.robot for mail in second] == ["r3", "noisy"]
    assert not more


def test_one_wake_up_per_burst() -> None:
    boxes, woken = Mailboxes(), []
    boxes.attach(lambda: woken.append(1))
    for sequence in range(5):
        boxes.put(letter(sequence=sequence))
    boxes.token("r2", "b0", True, 0)
    assert len(woken) == 1
    boxes.drain(10)
    boxes.refuse("r1", "pose", "malformed", "no", 0)
    assert len(woken) == 2


def test_mail_that_came_before_anybody_listened_wakes_at_once() -> None:
    boxes, woken = Mailboxes(), []
    boxes.put(letter())
    boxes.attach(lambda: woken.append(1))
    assert woken == [1]


def test_beyond_its_names_a_robot_is_counted_and_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mailbox, "MAX_NAMES", 3)
    boxes = Mailboxes()
    for sequence in range(5):
        boxes.put(letter(sequence=sequence))
    (mail,), _ = boxes.drain(1)
    box = mail.boxes["keyframe"]
    assert len(box.names) + box.refusals[mailbox.OVERFLOW].count == 5
    assert len(box.names) == 3


def test_waiting_payloads_are_bounded_in_all_and_given_back() -> None:
    boxes = Mailboxes(max_bytes=100)
    boxes.put(letter("r1", size=80))
    boxes.put(letter("r2", size=30))
    boxes.put(letter("r1", 1, size=90))
    first, _ = boxes.drain(10)
    kept = {mail.robot: mail.boxes["keyframe"].kept for mail in first}
    assert kept["r1"] is not None
    assert len(kept["r1"].data) == 90
    assert kept["r2"] is None
    assert first[1].boxes["keyframe"].refusals[mailbox.OVERFLOW].count == 1
    boxes.put(letter("r2", 1, size=100))
    (mail,), _ = boxes.drain(10)
    assert mail.boxes["keyframe"].kept is not None


def test_there_is_place_for_so_many_robots_and_the_others_are_counted() -> None:
    boxes = Mailboxes(max_robots=2)
    for robot in ("r1", "r2", "r3"):
        boxes.put(letter(robot))
    boxes.refuse("r4", "pose", "malformed", "no", 0)
    boxes.turn_away("wrong_key")
    mail, _ = boxes.drain(10)
    assert [each.robot for each in mail] == ["r1", "r2"]
    assert boxes.turned_away == {mailbox.TOO_MANY_ROBOTS: 2, "wrong_key": 1}


def test_a_robot_long_silent_gives_its_place_away() -> None:
    boxes = Mailboxes(max_robots=1)
    boxes.put(letter("r1"))
    boxes.drain(1)
    boxes.put(Letter("r2", "pose", "b0", 0, b"", IDLE_NS - 1))
    boxes.put(Letter("r2", "pose", "b0", 0, b"", IDLE_NS))
    (mail,), _ = boxes.drain(1)
    assert mail.robot == "r2"
    assert boxes.turned_away == {mailbox.TOO_MANY_ROBOTS: 1}


def test_of_tokens_the_last_word_counts_in_order_of_arrival() -> None:
    boxes = Mailboxes()
    for boot, alive in (("b0", False), ("b1", True), ("b0", True), ("b1", False)):
        boxes.token("r1", boot, alive, 0)
    for boot in range(2 * mailbox.MAX_TOKENS):
        boxes.token("r1", f"x{boot}", True, 0)
    (mail,), _ = boxes.drain(1)
    assert list(mail.tokens.items())[:2] == [("b0", True), ("b1", False)]
    assert len(mail.tokens) == mailbox.MAX_TOKENS


def test_threads_lose_nothing() -> None:
    boxes = Mailboxes()
    robots = [f"r{i}" for i in range(4)]

    def send(robot: str) -> None:
        for sequence in range(2000):
            boxes.put(letter(robot, sequence))

    threads = [Thread(target=send, args=(robot,)) for robot in robots]
    for thread in threads:
        thread.start()
    counted = 0
    while any(thread.is_alive() for thread in threads):
        counted += sum(len(mail.boxes["keyframe"].names) for mail in boxes.drain(2)[0])
    for thread in threads:
        thread.join()
    counted += sum(len(mail.boxes["keyframe"].names) for mail in boxes.drain(10)[0])
    assert counted == 4 * 2000


def test_depths_are_what_waits_and_nothing_when_it_is_taken() -> None:
    boxes = Mailboxes()
    assert boxes.depths() == Depths(0, 0, 0)
    for sequence, size in enumerate((3, 10, 7)):
        boxes.put(letter("r1", sequence, size=size))
    boxes.put(letter("r1", 0, topic="pose", size=2))
    boxes.put(letter("r2", 0, size=5))
    assert boxes.depths() == Depths(robots=2, messages=5, payload_bytes=7 + 2 + 5)
    boxes.drain(1)
    assert boxes.depths() == Depths(1, 1, 5)
    boxes.drain(1)
    assert boxes.depths() == Depths(0, 0, 0)
