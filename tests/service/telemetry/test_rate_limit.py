"""A flood writes a bounded number of lines, and what is left out is told in numbers."""

import logging
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from covista_service.telemetry.rate_limit import RateLimit, RateLimitOptions
from hypothesis import given
from hypothesis import strategies as st

from tests.service.telemetry.records import record

OPTIONS = RateLimitOptions(of_robot=2, of_kind=5, in_all=12, window_s=60, kinds=4, robots=6)


@dataclass
class Gate:
    """A limit with a clock that is set by hand, and what went through it."""

    options: RateLimitOptions = OPTIONS
    now_s: float = 100.0
    told: list[logging.LogRecord] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.limit = RateLimit(self.told.append, self.options, clock=lambda: self.now_s)

    def passes(self, message: str = "dropped", **fields: object) -> bool:
        return self.limit.filter(record(message, **fields))

    @property
    def left_out(self) -> dict[str, int]:
        return {each.fields["kind"]: each.fields["left_out"] for each in self.told}


def test_one_robot_has_its_lines_and_leaves_the_others_theirs() -> None:
    gate = Gate()
    assert [gate.passes(robot="r1") for _ in range(4)] == [True, True, False, False]
    assert [gate.passes(robot="r2") for _ in range(3)] == [True, True, False]
    assert [gate.passes(robot="r3") for _ in range(2)] == [True, False]


def test_a_pair_has_lines_like_a_robot() -> None:
    gate = Gate()
    assert [gate.passes(pair="a/b") for _ in range(3)] == [True, True, False]
    assert gate.passes(pair="a/c")


def test_what_is_about_nobody_has_the_lines_of_its_kind() -> None:
    gate = Gate()
    assert sum(gate.passes() for _ in range(9)) == 5


def test_kinds_are_told_apart_by_their_unformatted_message() -> None:
    gate = Gate()
    same = [gate.limit.filter(record("number %d", number)) for number in range(7)]
    assert sum(same) == 5
    assert gate.passes("another")


def test_when_the_window_is_over_one_line_a_kind_says_how_many_were_left_out() -> None:
    gate = Gate()
    for _ in range(9):
        gate.passes("dropped", robot="r1")
        gate.passes("failed")
    assert gate.told == []
    gate.now_s += 59.9
    gate.passes("failed")
    assert gate.told == []
    gate.now_s += 0.1
    assert gate.passes("dropped", robot="r1")
    assert gate.left_out == {"dropped": 7, "failed": 5}
    assert {each.levelno for each in gate.told} == {logging.WARNING}
    gate.now_s += 60
    assert gate.passes("failed")
    assert len(gate.told) == 2


events = st.tuples(st.integers(0, 7), st.one_of(st.none(), st.integers(0, 9)), st.sampled_from([0, 0, 0, 7, 60]))


@given(st.lists(events, max_size=200))
def test_whatever_comes_lines_are_bounded_and_nothing_is_left_out_untold(flood: list[tuple]) -> None:
    gate, passed = Gate(), 0
    for kind, robot, pause_s in flood:
        gate.now_s += pause_s
        passed += gate.passes(f"kind {kind}", robot=None if robot is None else f"r{robot}")
    gate.now_s += OPTIONS.window_s
    assert gate.passes("the end")
    assert passed + sum(each.fields["left_out"] for each in gate.told) == len(flood)
    windows = 1 + sum(pause_s for _, _, pause_s in flood) // OPTIONS.window_s
    assert passed <= windows * OPTIONS.in_all
    # One a kind, and one for all those that have no account of their own.
    assert len(gate.told) <= windows * (OPTIONS.kinds + 1)


def test_a_thousand_robots_that_send_garbage_write_no_more_than_one_kind_may() -> None:
    gate = Gate(RateLimitOptions())
    passed = sum(gate.passes(robot=f"r{number % 1000}") for number in range(20_000))
    assert passed == RateLimitOptions().of_kind
    gate.now_s += 60
    gate.passes()
    assert gate.left_out == {"dropped": 20_000 - passed}


def test_memory_is_bounded_where_every_message_is_a_kind_of_its_own() -> None:
    gate = Gate()
    for number in range(1000):
        gate.passes(f"number {number}", robot=f"r{number}")
    assert len(gate.limit._of_kind) <= OPTIONS.kinds + 1
    assert len(gate.limit._of_robot) <= OPTIONS.robots + 1
    assert len(gate.limit._left_out) <= OPTIONS.kinds + 1


def test_threads_share_the_same_limits() -> None:
    gate = Gate()
    with ThreadPoolExecutor(8) as threads:
        passed = list(threads.map(lambda _: gate.passes(), range(800)))
    assert sum(passed) == OPTIONS.of_kind
