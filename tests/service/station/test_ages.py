"""Which answers have grown too old, in whatever order they come; and how much may be done by now."""

import pytest
from covista_service.station.ages import Ages
from covista_service.station.allowance import Allowance
from hypothesis import given
from hypothesis import strategies as st

S = 1_000_000_000
times = st.integers(0, 20 * S)
pairs = st.tuples(st.sampled_from("abc"), st.sampled_from("xyz"))


@given(st.lists(st.tuples(pairs, times, st.booleans()), max_size=40), st.lists(times, min_size=1, max_size=5))
def test_exactly_those_that_are_old_are_taken_once(entered, asked: list[int]) -> None:
    ages, held = Ages(), {}
    for pair, time_ns, dropped in entered:
        if pair in held:
            ages.drop(pair, held.pop(pair))
        if not dropped:
            ages.put(pair, time_ns)
            held[pair] = time_ns
    for until_ns in sorted(asked):
        taken = ages.take(until_ns)
        assert len(taken) == len(set(taken))
        assert set(taken) == {pair for pair, time_ns in held.items() if time_ns <= until_ns}
        held = {pair: time_ns for pair, time_ns in held.items() if time_ns > until_ns}


def test_what_comes_late_is_taken_with_what_is_as_old() -> None:
    ages = Ages()
    ages.put(("a", "x"), 9 * S)
    ages.put(("a", "y"), 2 * S)
    assert ages.take(5 * S) == [("a", "y")]
    ages.put(("a", "z"), S)
    assert ages.take(5 * S) == [("a", "z")]
    assert ages.take(10 * S) == [("a", "x")]
    assert ages.take(99 * S) == []


def test_nothing_is_left_of_pairs_that_were_dropped() -> None:
    ages = Ages()
    ages.drop(("a", "x"), S)
    for second in range(1000):
        ages.put(("a", "x"), second * S)
        ages.drop(("a", "x"), second * S)
        assert ages.take(second * S - 10 * S) == []
    assert len(ages._of_second) <= 12


def test_an_allowance_is_full_at_first_and_fills_at_its_rate() -> None:
    allowance = Allowance(1000)
    assert allowance.at(0) == 250
    allowance.spend(250)
    assert allowance.at(0) == 0
    assert allowance.at(S // 10) == 100
    assert allowance.at(100 * S) == 250


def test_what_was_taken_too_much_is_missed_later() -> None:
    allowance = Allowance(1000)
    allowance.at(0)
    allowance.spend(350)
    assert allowance.at(0) <= 0
    assert allowance.at(S // 20) <= 0
    assert allowance.at(S // 5) == pytest.approx(100, abs=1)


def test_a_clock_that_was_set_back_gives_nothing_and_takes_nothing() -> None:
    allowance = Allowance(1000)
    allowance.at(100 * S)
    allowance.spend(200)
    assert allowance.at(50 * S) == 50
    assert allowance.at(50 * S + S // 10) == 150


@given(st.floats(0, 10_000), st.lists(st.integers(0, S), max_size=30))
def test_over_any_time_no_more_than_the_rate_and_what_was_kept(per_s: float, waits: list[int]) -> None:
    allowance, now_ns, taken = Allowance(per_s), 0, 0
    for wait_ns in waits:
        now_ns += wait_ns
        left = allowance.at(now_ns)
        allowance.spend(max(left, 0))
        taken += max(left, 0)
    assert taken <= per_s * (now_ns / S + 0.25) + 1e-6
