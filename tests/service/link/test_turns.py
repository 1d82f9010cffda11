from collections import Counter

from covista_service.link.turns import GRID_NS, Pace, Turns
from hypothesis import given
from hypothesis import strategies as st

MS = 1_000_000
GAP_NS = 50 * MS
# (robot, time since the one before), in order.
CALLS = st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 80 * MS)), max_size=40)


def test_the_first_after_a_pause_has_its_turn_at_once() -> None:
    turns = Turns(Pace(GAP_NS))
    for now_ns in (0, GAP_NS, 3 * GAP_NS):
        assert turns.stand("a", now_ns) == now_ns
        assert turns.take(1, now_ns) == ["a"]
    assert turns.next_ns(3 * GAP_NS) is None


@given(CALLS)
def test_turns_of_a_robot_are_a_gap_apart_and_nobody_waits_longer(calls: list[tuple[str, int]]) -> None:
    turns, now_ns = Turns(Pace(GAP_NS)), 0
    stands: dict[str, int] = {}
    had: dict[str, int] = {}
    for robot, pause_ns in calls:
        now_ns += pause_ns
        if robot not in stands:
            due_ns = turns.stand(robot, now_ns)
            assert now_ns <= due_ns <= now_ns + GAP_NS + GRID_NS
            stands[robot] = due_ns
        for taken in turns.take(10, now_ns):
            assert stands.pop(taken) <= now_ns
            assert now_ns - had.get(taken, -GAP_NS) >= GAP_NS
            had[taken] = now_ns
        assert all(due_ns > now_ns for due_ns in stands.values())
        assert turns.next_ns(now_ns) == min(stands.values(), default=None)


def test_robots_that_wait_fall_due_together() -> None:
    turns = Turns(Pace(GAP_NS))
    for number in range(9):
        turns.stand(f"r{number}", number * MS)
        turns.take(1, number * MS)
    dues = {turns.stand(f"r{number}", 10 * MS) for number in range(1, 9)}
    assert dues == {6 * GRID_NS}


def test_no_more_than_so_many_a_second_whoever_they_are() -> None:
    turns = Turns(Pace(GAP_NS, per_s=100, burst=5))
    taken: Counter[str] = Counter()
    for millisecond in range(2000):
        now_ns = millisecond * MS
        for number in range(10):
            robot = f"r{millisecond}-{number}"
            turns.stand(robot, now_ns)
        taken.update(turns.take(100, now_ns))
    assert 195 <= taken.total() <= 205


def test_without_an_allowance_it_says_when_to_come_again() -> None:
    turns = Turns(Pace(GAP_NS, per_s=100, burst=1))
    turns.stand("a", 0)
    turns.stand("b", 0)
    assert turns.take(2, 0) == ["a"]
    again_ns = turns.next_ns(0)
    assert again_ns is not None
    assert turns.take(2, again_ns) == ["b"]


def test_a_clock_that_is_set_back_holds_nobody_up() -> None:
    turns = Turns(Pace(GAP_NS, per_s=1000, burst=10))
    hour_ns = 3_600_000 * MS
    turns.stand("a", hour_ns)
    turns.take(1, hour_ns)
    turns.stand("a", hour_ns + 1)
    turns.stand("b", hour_ns + 1)
    assert turns.take(2, 0) == ["b", "a"]
    assert turns.stand("a", 1) <= GAP_NS + GRID_NS


def test_what_it_remembers_is_of_the_last_gap() -> None:
    turns = Turns(Pace(GAP_NS))
    for number in range(10_000):
        turns.stand(f"r{number}", number * MS)
        turns.take(1, number * MS)
    assert len(turns._last_ns) <= GAP_NS // MS
