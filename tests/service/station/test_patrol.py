"""Every possible pair once in a while: within the period it says, within its budget, and never too soon."""

from collections import Counter
from itertools import combinations, pairwise

import pytest
from covista_service.station.patrol import Patrol
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.scenes import START_NS, S

RETRY_NS = 30 * S


def nobody(robot: str) -> list[str]:
    return []


class Watch:
    """Robots that all send a keyframe a second, and hands that try whatever is asked."""

    def __init__(self, count: int, beside=nobody, retry_ns: int = RETRY_NS) -> None:
        self.patrol = Patrol(retry_ns)
        self.robots = [f"r{number:03}" for number in range(count)]
        self.beside = beside
        self.now_ns = START_NS
        self.tried: dict[tuple[str, str], list[int]] = {pair: [] for pair in combinations(self.robots, 2)}

    def second(self, keyframes: bool = True) -> int:
        count = 0
        for part in range(4):
            for robot in self.robots[part::4] if keyframes else ():
                self.patrol.keyframe(robot)
            while (pair := self.patrol.next(self.now_ns, self.beside)) is not None:
                self.patrol.tried(pair, self.now_ns, budgeted=True)
                self.tried[pair].append(self.now_ns)
                count += 1
            self.now_ns += S // 4
        return count


def test_in_a_small_swarm_every_pair_has_its_turn_every_thirty_seconds() -> None:
    watch = Watch(8)
    for _ in range(300):
        watch.second()
    for times in watch.tried.values():
        gaps = [(later - sooner) / S for sooner, later in pairwise(times)]
        assert min(gaps) >= 30
        assert max(gaps) <= 40
        assert (times[0] - START_NS) / S <= 10


@pytest.mark.parametrize("count", [30, 60])
def test_in_a_large_swarm_every_pair_has_its_turn_within_the_period_it_says(count: int) -> None:
    watch = Watch(count)
    rate = 6 + count / 16
    period = count * (count - 1) / rate
    for _ in range(int(2.2 * period)):
        watch.second()
    end = watch.now_ns
    for times in watch.tried.values():
        moments = [START_NS, *times, end]
        assert max(later - sooner for sooner, later in pairwise(moments)) <= (period + 5) * S


@pytest.mark.parametrize("count", [50, 200])
def test_tries_follow_keyframes_and_time_and_not_the_number_of_pairs(count: int) -> None:
    watch = Watch(count)
    tries = sum(watch.second() for _ in range(20))
    assert tries <= 16 + 20 * (6 + count / 16)
    assert tries >= 18 * 6


def test_without_new_keyframes_nothing_is_tried_twice() -> None:
    watch = Watch(6)
    for _ in range(10):
        watch.second(keyframes=not any(watch.tried.values()))
    before = {pair: len(times) for pair, times in watch.tried.items()}
    assert set(before.values()) == {1}
    for _ in range(200):
        watch.second(keyframes=False)
    assert {pair: len(times) for pair, times in watch.tried.items()} == before
    watch.patrol.keyframe("r002")
    for _ in range(10):
        watch.second(keyframes=False)
    assert {pair for pair, times in watch.tried.items() if len(times) > before[pair]} == {
        pair for pair in watch.tried if "r002" in pair
    }


def test_pairs_that_others_look_after_are_left_to_them() -> None:
    watch = Watch(5, lambda robot: [other for other in ("r000", "r001") if other != robot and robot in "r000 r001"])
    for _ in range(100):
        watch.second()
    assert watch.tried["r000", "r001"] == []
    assert min(len(times) for pair, times in watch.tried.items() if pair != ("r000", "r001")) >= 3


def test_what_another_queue_has_tried_is_not_tried_too_soon() -> None:
    watch = Watch(2)
    for robot in watch.robots:
        watch.patrol.keyframe(robot)
    watch.patrol.tried(("r000", "r001"), watch.now_ns, budgeted=False)
    assert sum(watch.second() for _ in range(30)) == 0
    assert sum(watch.second() for _ in range(5)) == 1


def test_a_clock_that_was_set_back_does_not_stop_it() -> None:
    watch = Watch(2)
    assert watch.second() == 1
    watch.now_ns -= 3600 * S
    assert sum(watch.second() for _ in range(5)) >= 1


@given(st.lists(st.tuples(st.sampled_from(["come", "go", "try"]), st.integers(0, 40)), max_size=120))
@settings(max_examples=60, deadline=None)
def test_who_comes_and_goes_does_not_mix_up_the_others(steps) -> None:
    """Against a table by names."""
    patrol, now_ns, there = Patrol(RETRY_NS), START_NS, []
    tried: dict[frozenset[str], int] = {}
    used: dict[str, int] = {}

    def due(name: str, other: str) -> bool:
        last_ns = tried.get(frozenset((name, other)), -RETRY_NS)
        return max(used[name], used[other]) > last_ns and now_ns - last_ns >= RETRY_NS

    for kind, number in steps:
        now_ns += S
        name = f"r{number}"
        if kind == "come":
            patrol.keyframe(name)
            there += [] if name in there else [name]
            used[name] = now_ns
        elif kind == "go" and name in there:
            patrol.forget(name)
            there.remove(name)
            tried = {pair: moment for pair, moment in tried.items() if name not in pair}
        elif kind == "try" and (pair := patrol.next(now_ns, nobody)) is not None:
            assert set(pair) <= set(there)
            assert now_ns - tried.get(frozenset(pair), -RETRY_NS) >= RETRY_NS
            # With the robot whose turn it is, the one tried longest ago.
            turn = patrol._names[patrol._turn]
            others = [other for other in there if other != turn and due(turn, other)]
            assert turn in pair
            assert tried.get(frozenset(pair), 0) == min(tried.get(frozenset((turn, other)), 0) for other in others)
            patrol.tried(pair, now_ns, budgeted=True)
            tried[frozenset(pair)] = now_ns
    for name in list(there):
        patrol.forget(name)
    assert patrol.next(now_ns, nobody) is None


def test_it_looks_at_few_robots_at_a_time_and_rests_when_there_is_nothing() -> None:
    asked: Counter[str] = Counter()

    def everybody(robot: str) -> list[str]:
        asked[robot] += 1
        return watch.robots[:-1]

    watch = Watch(100, everybody)
    for robot in watch.robots:
        watch.patrol.keyframe(robot)
    for _ in range(100):
        assert watch.patrol.next(START_NS, everybody) is None
    assert asked.total() <= 108


def test_room_for_moments_follows_the_number_of_robots() -> None:
    patrol = Patrol(RETRY_NS)
    for number in range(200):
        patrol.keyframe(f"r{number}")
    assert patrol._tried.shape == (len(patrol._used),) * 2
    assert 200 <= len(patrol._used) <= 250
