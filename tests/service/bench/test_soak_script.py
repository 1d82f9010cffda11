import random
from itertools import islice

import pytest
from covista_service.bench.soak_script import EVERY_S, LEAST_PAUSE_S, MOST_PAUSE_S, Turn, roster, spared, turns


def script(seed: int, count: int, robots: int = 12) -> list[Turn]:
    return list(islice(turns(random.Random(seed), robots), count))


def test_the_same_seed_gives_the_same_script_and_another_one_another() -> None:
    assert script(3, 200) == script(3, 200)
    assert script(3, 200) != script(4, 200)
    assert script(3, 200)[:50] == script(3, 50)


def test_all_sorts_of_things_happen_to_everybody_as_often_as_it_says() -> None:
    told = script(0, 5000)
    assert {turn.robot for turn in told} == set(range(12))
    assert {turn.act for turn in told} == {"leave", "kill", "reboot", "pause", "garbage"}
    assert sum(turn.gap_s for turn in told) / len(told) == pytest.approx(EVERY_S, rel=0.05)
    assert all(LEAST_PAUSE_S <= turn.pause_s <= MOST_PAUSE_S for turn in told)


def test_a_third_of_the_robots_is_never_killed() -> None:
    assert sum(spared(robot) for robot in range(12)) == 4
    assert not any(turn.act in ("kill", "reboot") and spared(turn.robot) for turn in script(0, 5000))


def test_as_many_are_there_at_first_as_in_the_long_run() -> None:
    first = [len(roster(random.Random(seed), 12)) for seed in range(2000)]
    later: list[int] = []
    there = set(roster(random.Random(0), 12))
    for turn in script(0, 20_000):
        if turn.robot not in there:
            there.add(turn.robot)
        elif turn.act in ("leave", "kill"):
            there.remove(turn.robot)
        later.append(len(there))
    assert sum(first) / len(first) == pytest.approx(sum(later) / len(later), rel=0.02)
