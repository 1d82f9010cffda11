from collections import Counter
from threading import Thread

import pytest
from covista_service.link import mailbox
from covista_service.link.mailbox import IDLE_NS, PACES, Depths, Letter, Mailboxes
from covista_service.link.turns import GRID_NS
from covista_service.station.events import Topic
from covista_service.station.ledger import Run

# Later than whatever came.
NOW_NS = 10 * IDLE_NS
GAP_NS = PACES["keyframe"].gap_ns


def letter(
    robot: str = "r1",
    sequence: int = 0,
    *,
    boot: str = "b0",
    topic: Topic = "keyframe",
    size: int = 1,
    arrived_ns: int = 0,
) -> Letter:
    return Letter(robot, topic, boot, sequence, b"x" * size, arrived_ns)


def test_the_newest_wins_and_every_message_keeps_its_name() -> None:
    boxes = Mailboxes()
    for sequence in (0, 1, 2):
        boxes.put(letter(sequence=sequence))
    (mail,), more = boxes.drain(10, NOW_NS)
    box = mail.boxes["keyframe"]
    assert box.kept is not None
    assert (box.kept.sequence, box.names, more) == (2, [("b0", 0), ("b0", 1), ("b0", 2)], None)
    assert boxes.drain(10, NOW_NS) == ([], None)


def test_a_message_that_overtook_another_is_kept() -> None:
    boxes = Mailboxes()
    boxes.put(letter(sequence=5))
    boxes.put(letter(sequence=4))
    (mail,), _ = boxes.drain(10, NOW_NS)
    assert mail.boxes["keyframe"].kept is not None
    assert mail.boxes["keyframe"].kept.sequence == 5


def test_a_new_boot_starts_from_zero_and_wins() -> None:
    boxes = Mailboxes()
    boxes.put(letter(sequence=70, boot="old"))
    boxes.put(letter(sequence=0, boot="new"))
    (mail,), _ = boxes.drain(10, NOW_NS)
    assert mail.boxes["keyframe"].kept is not None
    assert mail.boxes["keyframe"].kept.name == ("new", 0)


def test_topics_do_not_replace_each_other() -> None:
    boxes = Mailboxes()
    boxes.put(letter(sequence=3))
    boxes.put(letter(sequence=9, topic="pose"))
    (mail,), _ = boxes.drain(10, NOW_NS)
    assert {topic: box.names for topic, box in mail.boxes.items()} == {"keyframe": [("b0", 3)], "pose": [("b0", 9)]}


def test_a_flood_of_one_robot_leaves_the_others_their_turn() -> None:
    boxes = Mailboxes()
    for sequence in range(1000):
        boxes.put(letter("noisy", sequence))
    boxes.put(letter("r2"))
    boxes.put(letter("r3"))
    first, again_ns = boxes.drain(2, NOW_NS)
    assert [mail.robot for mail in first] == ["noisy", "r2"]
    assert again_ns == NOW_NS
    boxes.put(letter("noisy", 1000, arrived_ns=NOW_NS))
    second, again_ns = boxes.drain(2, NOW_NS)
    assert [mail.robot for mail in second] == ["r3"]
    assert again_ns is not None
    third, _ = boxes.drain(2, again_ns)
    assert [mail.robot for mail in third] == ["noisy"]


def test_what_comes_within_a_gap_is_conflated_and_counted() -> None:
    boxes = Mailboxes()
    boxes.put(letter(arrived_ns=NOW_NS))
    (first,), _ = boxes.drain(10, NOW_NS)
    for sequence in range(1, 6):
        boxes.put(letter(sequence=sequence, arrived_ns=NOW_NS + sequence))
    held, due_ns = boxes.drain(10, NOW_NS + 10)
    assert held == []
    assert due_ns is not None
    assert GAP_NS <= due_ns - NOW_NS <= GAP_NS + GRID_NS
    assert boxes.drain(10, due_ns - 1) == ([], due_ns)
    (second,), again_ns = boxes.drain(10, due_ns)
    box = second.boxes["keyframe"]
    assert box.kept is not None
    assert (box.kept.sequence, len(first.boxes["keyframe"].names), len(box.names), again_ns) == (5, 1, 5, None)


def test_a_flood_of_poses_does_not_hold_up_keyframes_nor_another_robot() -> None:
    boxes = Mailboxes()
    boxes.put(letter("noisy", topic="pose", arrived_ns=NOW_NS))
    boxes.drain(10, NOW_NS)
    boxes.put(letter("noisy", 1, topic="pose", arrived_ns=NOW_NS + 1))
    boxes.put(letter("noisy", 0, arrived_ns=NOW_NS + 1))
    boxes.put(letter("r2", 0, topic="pose", arrived_ns=NOW_NS + 1))
    mail, _ = boxes.drain(10, NOW_NS + 1)
    assert [(each.robot, list(each.boxes)) for each in mail] == [("noisy", ["keyframe"]), ("r2", ["pose"])]


def test_tokens_and_keyframes_go_before_poses() -> None:
    boxes = Mailboxes()
    boxes.put(letter("r1", topic="pose"))
    boxes.put(letter("r2"))
    boxes.token("r3", "b0", True, 0)
    assert [mail.robot for mail in boxes.drain(10, NOW_NS)[0]] == ["r3", "r2", "r1"]


def test_poses_of_all_robots_together_come_at_a_bounded_rate_and_in_turn() -> None:
    boxes = Mailboxes()
    robots = [f"r{i}" for i in range(1000)]
    taken: Counter[str] = Counter()
    for millisecond in range(1000):
        now_ns = NOW_NS + millisecond * 1_000_000
        for robot in robots[millisecond % 10 :: 10]:
            boxes.put(letter(robot, millisecond, topic="pose", arrived_ns=now_ns))
        taken.update(mail.robot for mail in boxes.drain(32, now_ns)[0])
    pace = PACES["pose"]
    assert pace.per_s is not None
    assert 0.9 * pace.per_s <= taken.total() <= pace.per_s + pace.burst
    assert max(taken.values()) - min(taken[robot] for robot in robots) <= 1


def test_one_wake_up_per_burst() -> None:
    boxes, woken = Mailboxes(), []
    boxes.attach(lambda: woken.append(1))
    for sequence in range(5):
        boxes.put(letter(sequence=sequence))
    boxes.token("r2", "b0", True, 0)
    assert len(woken) == 1
    boxes.drain(10, NOW_NS)
    boxes.refuse("r1", "pose", "malformed", lambda: "no", 0)
    assert len(woken) == 2


def test_who_need_not_wait_wakes_the_loop_though_others_are_held() -> None:
    boxes, woken = Mailboxes(), []
    boxes.attach(lambda: woken.append(1))
    boxes.put(letter("noisy", arrived_ns=NOW_NS))
    boxes.drain(10, NOW_NS)
    boxes.put(letter("noisy", 1, arrived_ns=NOW_NS + 1))
    _, due_ns = boxes.drain(10, NOW_NS + 1)
    before = len(woken)
    for sequence in range(2, 100):
        boxes.put(letter("noisy", sequence, arrived_ns=NOW_NS + 2))
    assert len(woken) == before
    boxes.put(letter("r2", arrived_ns=NOW_NS + 3))
    assert len(woken) == before + 1
    assert [mail.robot for mail in boxes.drain(10, NOW_NS + 3)[0]] == ["r2"]
    assert due_ns is not None
    assert [mail.robot for mail in boxes.drain(10, due_ns)[0]] == ["noisy"]


def test_depths_are_what_waits() -> None:
    boxes = Mailboxes()
    assert boxes.depths() == Depths(0, 0, 0)
    for sequence in range(3):
        boxes.put(letter("r1", sequence, size=10))
    boxes.put(letter("r2", topic="pose", size=5))
    boxes.token("r3", "b0", True, 0)
    assert boxes.depths() == Depths(3, 4, 15)
    boxes.drain(10, NOW_NS)
    assert boxes.depths() == Depths(0, 0, 0)


def test_mail_that_came_before_anybody_listened_wakes_at_once() -> None:
    boxes, woken = Mailboxes(), []
    boxes.put(letter())
    boxes.attach(lambda: woken.append(1))
    assert woken == [1]


def test_beyond_its_names_the_newest_is_kept_and_what_it_displaces_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mailbox, "MAX_NAMES", 3)
    boxes = Mailboxes()
    for sequence in (0, 1, 2, 3, 9, 4):
        boxes.put(letter(sequence=sequence))
    (mail,), _ = boxes.drain(1, NOW_NS)
    box = mail.boxes["keyframe"]
    assert box.kept is not None
    assert box.kept.name == ("b0", 9)
    assert box.names == [("b0", 0), ("b0", 1), ("b0", 9)]
    assert box.surplus.runs() == (Run("b0", 2, 5, 3),)


def test_only_the_first_refusal_of_a_burst_is_put_into_words() -> None:
    boxes, asked = Mailboxes(), []

    def explain() -> str:
        asked.append(1)
        return "no"

    for _ in range(100):
        boxes.refuse("r1", "pose", "malformed", explain, 0)
    (mail,), _ = boxes.drain(1, NOW_NS)
    refusal = mail.garbage["pose"].refusals["malformed"]
    assert (refusal.count, refusal.text, len(asked)) == (100, "no", 1)


def test_garbage_under_many_names_takes_no_places_from_robots() -> None:
    boxes = Mailboxes(max_robots=100)
    for number in range(1000):
        boxes.refuse(f"x{number}", "pose", "malformed", lambda: "no", 0)
    for number in range(20):
        boxes.put(letter(f"r{number}"))
    mail, _ = boxes.drain(2000, NOW_NS)
    robots = {each.robot for each in mail}
    assert {f"r{number}" for number in range(20)} <= robots
    counted = sum(box.refusals["malformed"].count for each in mail for box in each.garbage.values())
    assert counted + boxes.turned_away[mailbox.UNKNOWN_ROBOT] == 1000


def test_garbage_is_heard_of_twice_a_second_and_holds_up_nothing_readable() -> None:
    boxes, heard, used = Mailboxes(), 0, 0
    for step in range(40):
        now_ns = NOW_NS + step * GAP_NS
        boxes.refuse("r1", "keyframe", "malformed", lambda: "no", now_ns)
        boxes.put(letter("r1", step, arrived_ns=now_ns))
        for mail in boxes.drain(10, now_ns)[0]:
            heard += "keyframe" in mail.garbage
            used += "keyframe" in mail.boxes
    # 40 gaps of 50 ms are two seconds.
    assert (heard, used) == (4, 40)


def test_waiting_payloads_are_bounded_in_all_and_given_back() -> None:
    boxes = Mailboxes(max_bytes=100)
    boxes.put(letter("r1", size=80))
    boxes.put(letter("r2", size=30))
    boxes.put(letter("r1", 1, size=90))
    first, _ = boxes.drain(10, NOW_NS)
    kept = {mail.robot: mail.boxes["keyframe"].kept for mail in first}
    assert kept["r1"] is not None
    assert len(kept["r1"].data) == 90
    assert kept["r2"] is None
    assert first[1].boxes["keyframe"].surplus.runs() == (Run("b0", 0, 1, 1),)
    boxes.put(letter("r2", 1, size=100))
    (mail,), _ = boxes.drain(10, NOW_NS)
    assert mail.boxes["keyframe"].kept is not None


def test_there_is_place_for_so_many_robots_and_the_others_are_counted() -> None:
    boxes = Mailboxes(max_robots=2)
    for robot in ("r1", "r2", "r3"):
        boxes.put(letter(robot))
    boxes.refuse("r4", "pose", "malformed", lambda: "no", 0)
    boxes.turn_away("wrong_key")
    mail, _ = boxes.drain(10, NOW_NS)
    assert [each.robot for each in mail] == ["r1", "r2"]
    assert boxes.turned_away == {mailbox.TOO_MANY_ROBOTS: 2, "wrong_key": 1}


def test_a_robot_long_silent_gives_its_place_away() -> None:
    boxes = Mailboxes(max_robots=1)
    boxes.put(letter("r1"))
    boxes.drain(1, 0)
    boxes.put(Letter("r2", "pose", "b0", 0, b"", IDLE_NS - 1))
    boxes.put(Letter("r2", "pose", "b0", 0, b"", IDLE_NS))
    (mail,), _ = boxes.drain(1, NOW_NS)
    assert mail.robot == "r2"
    assert boxes.turned_away == {mailbox.TOO_MANY_ROBOTS: 1}


def test_of_tokens_the_last_word_counts_in_order_of_arrival() -> None:
    boxes = Mailboxes()
    for boot, alive in (("b0", False), ("b1", True), ("b0", True), ("b1", False)):
        boxes.token("r1", boot, alive, 0)
    for boot in range(2 * mailbox.MAX_TOKENS):
        boxes.token("r1", f"x{boot}", True, 0)
    (mail,), _ = boxes.drain(1, NOW_NS)
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
    now_ns = NOW_NS
    while any(thread.is_alive() for thread in threads):
        now_ns += GAP_NS
        counted += sum(len(mail.boxes["keyframe"].names) for mail in boxes.drain(2, now_ns)[0])
    for thread in threads:
        thread.join()
    counted += sum(len(mail.boxes["keyframe"].names) for mail in boxes.drain(10, now_ns + 2 * GAP_NS)[0])
    assert counted == 4 * 2000


def test_depths_are_what_waits_and_nothing_when_it_is_taken() -> None:
    boxes = Mailboxes()
    assert boxes.depths() == Depths(0, 0, 0)
    for sequence, size in enumerate((3, 10, 7)):
        boxes.put(letter("r1", sequence, size=size))
    boxes.put(letter("r1", 0, topic="pose", size=2))
    boxes.put(letter("r2", 0, size=5))
    assert boxes.depths() == Depths(robots=2, messages=5, payload_bytes=7 + 2 + 5)
    boxes.drain(1, NOW_NS)
    assert boxes.depths() == Depths(1, 1, 5)
    boxes.drain(1, NOW_NS)
    assert boxes.depths() == Depths(0, 0, 0)


def test_while_a_fault_is_put_into_words_others_are_served_and_all_is_counted() -> None:
    boxes = Mailboxes()

    def explain() -> str:
        boxes.put(letter("r2"))
        boxes.refuse("r1", "pose", "malformed", lambda: "no", 0)
        return "no"

    boxes.refuse("r1", "pose", "malformed", explain, 0)
    mail, _ = boxes.drain(10, NOW_NS)
    assert {each.robot for each in mail} == {"r1", "r2"}
    (box,) = (each.garbage["pose"] for each in mail if each.robot == "r1")
    assert box.refusals["malformed"].count == 2


def test_a_fault_is_put_into_words_though_the_loop_came_between() -> None:
    boxes, woken = Mailboxes(), []
    boxes.attach(lambda: woken.append(1))

    def explain() -> str:
        assert boxes.drain(10, NOW_NS) == ([], None)
        return "no"

    boxes.refuse("r1", "pose", "malformed", explain, 0)
    (mail,), _ = boxes.drain(10, NOW_NS)
    refusal = mail.garbage["pose"].refusals["malformed"]
    assert (refusal.count, refusal.text, woken) == (1, "no", [1])


def test_tokens_under_many_names_lock_no_robot_out() -> None:
    boxes = Mailboxes(max_robots=100)
    for number in range(1000):
        boxes.token(f"x{number}", "b0", True, 0)
    for number in range(100):
        boxes.put(letter(f"r{number}"))
    mail, _ = boxes.drain(2000, NOW_NS)
    assert {f"r{number}" for number in range(100)} <= {each.robot for each in mail}
    assert boxes.turned_away == {mailbox.TOO_MANY_ROBOTS: 900}


def test_the_end_of_a_token_is_heard_also_of_a_robot_that_gave_its_place_away() -> None:
    boxes = Mailboxes(max_robots=1)
    boxes.token("x1", "b0", True, 0)
    boxes.drain(10, NOW_NS)
    boxes.put(letter("r1"))
    boxes.token("x1", "b0", False, 0)
    boxes.token("x2", "b0", False, 0)
    mail, _ = boxes.drain(10, NOW_NS)
    assert [(each.robot, each.tokens) for each in mail] == [("x1", {"b0": False}), ("r1", {})]
    assert boxes.turned_away == {mailbox.TOO_MANY_ROBOTS: 1}


def test_mail_waits_of_no_more_than_twice_as_many_robots_as_there_are_places() -> None:
    boxes = Mailboxes(max_robots=2)
    boxes.put(letter("r1"))
    for stranger in ("x1", "x2", "x3"):
        boxes.token(stranger, "b0", False, 0)
    boxes.put(letter("r2"))
    assert boxes.depths().robots == 4
    assert boxes.turned_away == {mailbox.TOO_MANY_ROBOTS: 1}
    boxes.drain(10, NOW_NS)
    boxes.token("x3", "b0", False, NOW_NS)
    assert boxes.depths().robots == 1
