import pytest
from covista_service.link.places import IDLE_NS, TOO_MANY_ROBOTS, UNKNOWN_ROBOT, Places, Word


def enter(places: Places, robot: str, now_ns: int = 0, *, word: Word = "message", waiting: tuple[str, ...] = ()) -> str:
    return places.admit(robot, now_ns, word, waiting=waiting) or "in"


@pytest.mark.parametrize("word", ["message", "garbage"])
def test_who_is_in_stays_in(word: Word) -> None:
    places = Places(1)
    for _ in range(3):
        assert enter(places, "r1", word=word) == "in"
    assert enter(places, "r2") == TOO_MANY_ROBOTS
    assert enter(places, "r1", word=word) == "in"


def test_strangers_have_few_places_and_robots_the_rest() -> None:
    places = Places(3, max_strangers=1)
    assert enter(places, "x1", word="garbage") == "in"
    assert enter(places, "x2", word="garbage") == UNKNOWN_ROBOT
    assert enter(places, "r1") == "in"
    assert enter(places, "r2") == "in"
    assert enter(places, "r1", word="garbage") == "in"


def test_who_says_something_readable_is_no_stranger_any_more() -> None:
    places = Places(3, max_strangers=1)
    enter(places, "x1", word="garbage")
    enter(places, "x1")
    assert enter(places, "x2", word="garbage") == "in"


@pytest.mark.parametrize("word", ["message", "token", "garbage"])
def test_who_is_long_silent_gives_its_place_away_unless_its_mail_waits(word: Word) -> None:
    places = Places(1, max_strangers=1)
    enter(places, "r1", word=word)
    assert enter(places, "r2", IDLE_NS - 1, word=word) != "in"
    assert enter(places, "r2", IDLE_NS, word=word, waiting=("r1",)) != "in"
    assert enter(places, "r2", IDLE_NS, word=word) == "in"
    assert enter(places, "r1", IDLE_NS, word=word) != "in"


def test_who_has_but_a_token_gives_way_to_whoever_sends_a_message_oldest_first() -> None:
    places = Places(3)
    for robot in ("x1", "x2", "x3"):
        assert enter(places, robot, word="token") == "in"
    assert enter(places, "x4", word="token") == TOO_MANY_ROBOTS
    assert enter(places, "x2") == "in"
    assert enter(places, "r1", waiting=("x1", "x3")) == "in"
    assert ["x1" in places, "x2" in places, "x3" in places] == [False, True, True]
    assert enter(places, "r2") == "in"
    assert enter(places, "r3") == TOO_MANY_ROBOTS
    assert enter(places, "x1", word="token") == TOO_MANY_ROBOTS


def test_a_stranger_with_a_token_gives_way_likewise_and_frees_a_stranger_s_place() -> None:
    places = Places(2, max_strangers=1)
    for word in ("garbage", "token"):
        assert enter(places, "x1", word=word) == "in"
    assert enter(places, "x2", word="garbage") == "in"
    assert enter(places, "r1") == "in"
    assert "x1" not in places


def test_who_calls_and_who_parts_are_together_no_more_than_there_are_places() -> None:
    places = Places(2)
    assert enter(places, "c1", word="token") == "in"
    assert places.part("x1")
    assert not places.part("x2")
    assert enter(places, "c2", word="token") == TOO_MANY_ROBOTS
    # Of two messages one has the free place, and the other that of the caller, which parts.
    assert [enter(places, robot, waiting=("c1", "x1")) for robot in ("r1", "r2")] == ["in", "in"]
    assert "c1" not in places
    assert not places.part("x2")
    places.parted("c1")
    assert places.part("x2")


def test_who_parts_and_comes_back_parts_no_more() -> None:
    places = Places(2)
    assert all(places.part(robot) for robot in ("x1", "x2"))
    assert enter(places, "x1", word="token") == "in"
    assert not places.part("x3")
    assert enter(places, "x1") == "in"
    assert places.part("x3")
