import pytest
from covista_service.link.places import IDLE_NS, TOO_MANY_ROBOTS, UNKNOWN_ROBOT, Places


def enter(places: Places, robot: str, now_ns: int = 0, *, readable: bool = True, waiting: tuple[str, ...] = ()) -> str:
    return places.admit(robot, now_ns, readable=readable, waiting=waiting) or "in"


@pytest.mark.parametrize("readable", [True, False])
def test_who_is_in_stays_in(readable: bool) -> None:
    places = Places(1)
    for _ in range(3):
        assert enter(places, "r1", readable=readable) == "in"
    assert enter(places, "r2") == TOO_MANY_ROBOTS
    assert enter(places, "r1", readable=readable) == "in"


def test_strangers_have_few_places_and_robots_the_rest() -> None:
    places = Places(3, max_strangers=1)
    assert enter(places, "x1", readable=False) == "in"
    assert enter(places, "x2", readable=False) == UNKNOWN_ROBOT
    assert enter(places, "r1") == "in"
    assert enter(places, "r2") == "in"
    assert enter(places, "r1", readable=False) == "in"


def test_who_says_something_readable_is_no_stranger_any_more() -> None:
    places = Places(3, max_strangers=1)
    enter(places, "x1", readable=False)
    enter(places, "x1")
    assert enter(places, "x2", readable=False) == "in"


@pytest.mark.parametrize("readable", [True, False])
def test_who_is_long_silent_gives_its_place_away_unless_its_mail_waits(readable: bool) -> None:
    places = Places(1, max_strangers=1)
    enter(places, "r1", readable=readable)
    assert enter(places, "r2", IDLE_NS - 1, readable=readable) != "in"
    assert enter(places, "r2", IDLE_NS, readable=readable, waiting=("r1",)) != "in"
    assert enter(places, "r2", IDLE_NS, readable=readable) == "in"
    assert enter(places, "r1", IDLE_NS, readable=readable) != "in"
