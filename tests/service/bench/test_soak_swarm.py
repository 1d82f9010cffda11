"""What happens to rovers, with rovers in memory and a clock in the hand."""

import random
from collections.abc import Iterator
from itertools import islice

import pytest
from covista_service.bench.soak_books import FORGOTTEN_S, KNOWN_S, LAST_S, Books, bounds
from covista_service.bench.soak_rover import Told
from covista_service.bench.soak_script import Act, Turn, turns
from covista_service.bench.soak_swarm import AFTER_PAUSE_S, AGREE_S, LEAVE_S, SoakSwarm

BURST = 300


class Body:
    """A rover that has sent so many messages when it is told to leave, and ends when it is let."""

    def __init__(self, sends: int = 10) -> None:
        self.sends = sends
        self.told: list[tuple[float, Told]] = []
        self.acts: list[str] = []
        self.gone = False
        self.stubborn = False

    def leave(self) -> None:
        self.acts.append("leave")
        if not self.stubborn:
            self.told.append((0.0, Told(0, self.sends, over=True)))
            self.gone = True

    def kill(self) -> None:
        self.acts.append("kill")
        self.gone = True

    def pause(self) -> None:
        self.acts.append("pause")

    def go_on(self) -> None:
        self.acts.append("go on")

    def ended(self) -> bool:
        return self.gone

    def close(self) -> None:
        self.acts.append("close")


class Stage:
    """A swarm that is told what happens, and a station that has heard what it is said to have."""

    def __init__(self, script: Iterator[Turn] | None = None) -> None:
        self.now_s = 0.0
        self.bodies: list[tuple[int, Body]] = []
        self.heard: dict[int, int] = {}
        self.books = Books(self.heard.get)
        script = script if script is not None else iter([Turn(1e9, 0, "leave", 0.0)] * 2)
        self.swarm = SoakSwarm(self.start, lambda robot: BURST, script, self.books, lambda: self.now_s)

    def start(self, robot: int) -> Body:
        self.bodies.append((robot, Body()))
        return self.bodies[-1][1]

    def befall(self, robot: int, act: Act, pause_s: float = 5.0) -> None:
        self.swarm._befall(Turn(0.0, robot, act, pause_s), self.now_s)

    def later(self, seconds: float) -> None:
        self.now_s += seconds
        self.swarm.happen()

    @property
    def last(self) -> Body:
        return self.bodies[-1][1]


def test_who_is_not_there_joins_whatever_the_turn_says() -> None:
    stage = Stage()
    stage.befall(3, "kill")
    assert stage.swarm.there == {3}
    assert stage.swarm.happened == {"join": 1}


def test_who_leaves_holds_nobody_up_and_is_gone_once_its_books_agree() -> None:
    stage = Stage()
    stage.swarm.gather([1])
    stage.befall(1, "leave")
    assert stage.last.acts == ["leave"]
    stage.later(1)
    stage.befall(1, "kill")
    assert stage.swarm.there == {1}
    stage.heard[1] = 10
    stage.later(1)
    assert stage.swarm.there == frozenset()
    assert (stage.books.compared, stage.books.off, stage.swarm.died) == (1, 0, 0)
    assert (stage.books.sent.least, stage.books.sent.most) == (10, 10)
    assert stage.swarm.happened == {"leave": 1}


@pytest.mark.parametrize(("heard", "off"), [(9, 1), (12, 2)])
def test_a_message_that_a_robot_lost_which_was_never_killed_shows(heard: int, off: int) -> None:
    stage = Stage()
    stage.swarm.gather([1, 2])
    stage.befall(2, "kill")
    stage.befall(1, "leave")
    stage.heard[1] = heard
    stage.later(1)
    stage.later(AGREE_S - 0.1)
    assert stage.swarm.there == {1}
    stage.later(0.2)
    assert (stage.books.compared, stage.books.off) == (1, off)


def test_who_does_not_leave_is_killed_after_a_while_and_is_not_held_to_the_message() -> None:
    stage = Stage()
    stage.swarm.gather([1])
    stage.last.stubborn = True
    stage.befall(1, "leave")
    stage.later(LEAVE_S - 0.1)
    assert stage.last.acts == ["leave"]
    for _ in range(3):
        stage.later(0.2)
    assert stage.last.acts == ["leave", "kill", "close"]
    assert stage.swarm.there == frozenset()
    assert (stage.books.compared, stage.swarm.died) == (0, 0)


def test_who_dies_unasked_is_counted() -> None:
    stage = Stage()
    stage.swarm.gather([1, 2])
    stage.bodies[0][1].gone = True
    stage.later(1)
    stage.later(1)
    assert stage.swarm.died == 1
    assert stage.swarm.there == {2}


def test_who_is_paused_goes_on_in_time_and_is_left_alone_for_a_while() -> None:
    stage = Stage()
    stage.swarm.gather([1])
    stage.befall(1, "pause", 5.0)
    stage.later(4.9)
    stage.befall(1, "kill")
    assert stage.last.acts == ["pause"]
    stage.later(0.2)
    stage.befall(1, "kill")
    assert stage.last.acts == ["pause", "go on"]
    stage.later(AFTER_PAUSE_S)
    stage.befall(1, "kill")
    assert stage.last.acts == ["pause", "go on", "kill", "close"]
    assert stage.swarm.there == frozenset()


def test_who_starts_again_has_another_body_at_once() -> None:
    stage = Stage()
    stage.swarm.gather([1])
    stage.befall(1, "reboot")
    assert [body.gone for _, body in stage.bodies] == [True, False]
    assert stage.swarm.there == {1}
    assert stage.swarm.died == 0


def test_garbage_is_on_the_robot_s_account() -> None:
    stage = Stage()
    stage.swarm.gather([1])
    stage.befall(1, "garbage")
    stage.befall(1, "leave")
    stage.heard[1] = BURST + 10
    stage.later(1)
    stage.later(1)
    assert (stage.books.sent.garbage, stage.books.compared, stage.books.off) == (BURST, 1, 0)


@pytest.mark.parametrize(("silent_s", "heard"), [(KNOWN_S - 1, 20), (FORGOTTEN_S + 1, 10)])
def test_an_account_begins_anew_when_the_robot_has_been_forgotten(silent_s: float, heard: int) -> None:
    stage = Stage()
    for known in (10, heard):
        stage.befall(1, "leave")
        stage.befall(1, "leave")
        stage.heard[1] = known
        stage.later(0)
        stage.later(0)
        stage.later(silent_s)
    assert (stage.books.compared, stage.books.off) == (2, 0)


def test_of_who_may_have_been_forgotten_or_not_nothing_is_compared_until_it_surely_is() -> None:
    stage = Stage()
    stage.heard[1] = 10
    for silent_s in ((KNOWN_S + FORGOTTEN_S) / 2, 1.0, FORGOTTEN_S + 1, 0.0):
        stage.befall(1, "leave")
        stage.befall(1, "leave")
        stage.later(0)
        stage.later(0)
        stage.later(silent_s)
    assert (stage.books.compared, stage.books.off) == (2, 0)


def test_in_the_end_all_leave_in_order_also_who_was_paused() -> None:
    stage = Stage()
    stage.swarm.gather([1, 2])
    stage.befall(2, "pause", 100.0)
    stage.heard.update({1: 10, 2: 10})
    for _ in range(4):
        stage.swarm.disperse()
        stage.now_s += AFTER_PAUSE_S / 2
    stage.swarm.disperse()
    assert stage.swarm.there == frozenset()
    assert stage.books.compared == 2


def test_however_it_ends_no_process_stays() -> None:
    stage = Stage()
    stage.swarm.gather(range(3))
    stage.befall(1, "pause")
    stage.swarm.end()
    assert all(body.gone and body.acts[-1] == "close" for _, body in stage.bodies)


def played(looks_s: float) -> list[tuple[int, str]]:
    """What came of a script of 200 turns, looked after every so often: nothing of it is up to the machine."""
    stage = Stage(turns(random.Random(5), 4))
    told: list[tuple[int, str]] = []
    begun = stage.swarm._befall
    stage.swarm._befall = lambda turn, now_s: (told.append((turn.robot, turn.act)), begun(turn, now_s))
    while len(told) < 200:
        stage.later(looks_s)
    return told[:200]


def test_the_same_script_is_played_however_often_anybody_looks() -> None:
    expected = [(turn.robot, turn.act) for turn in islice(turns(random.Random(5), 4), 200)]
    assert played(0.5) == played(7.0) == expected


def test_a_boot_that_left_in_order_has_sent_what_it_says_and_one_that_was_killed_nearly_that() -> None:
    told = [(at_s, Told(round(at_s), round(2 * at_s))) for at_s in (8.0, 9.5, 9.9)]
    least, most = bounds(told, 10.0)
    assert least == 24
    assert most >= 30
    assert bounds([*told, (10.0, Told(11, 21, over=True))], 10.0) == (32, 32)
    assert bounds([], LAST_S / 2)[0] == 0
