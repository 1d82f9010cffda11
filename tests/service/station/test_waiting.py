"""The queue by expected news: more news more turns, and nobody is overtaken for ever."""

from collections import Counter

import numpy as np
import pytest
from covista_service.perception.camera import Pose
from covista_service.station.waiting import MOST, Plan, Waiting
from hypothesis import given
from hypothesis import strategies as st

HERE = Pose(np.eye(3), np.zeros(3))


class Pairs:
    """Pairs that wait again as soon as they were served, each with news of its own."""

    def __init__(self, news: dict[str, float]) -> None:
        self.news = {(name, "z"): amount for name, amount in news.items()}
        self.waiting = Waiting()
        self.plans = {pair: Plan(0.0) for pair in self.news}
        for pair in self.news:
            self.put(pair)

    def put(self, pair) -> None:
        self.waiting.put(pair, self.plans[pair], self.news[pair])

    def serve(self) -> str:
        pair = self.waiting.take()
        assert pair is not None
        self.waiting.served(pair, self.plans[pair], (HERE, HERE))
        self.put(pair)
        return pair[0]


def test_equals_take_turns() -> None:
    pairs = Pairs(dict.fromkeys("abcde", 0.3))
    assert [pairs.serve() for _ in range(10)] == list("abcde") * 2


def test_turns_go_by_news() -> None:
    pairs = Pairs({"a": 0.0, "b": 1.0, "c": 3.0})
    served = Counter(pairs.serve() for _ in range(7 * 40))
    assert served["a"] == pytest.approx(40, abs=2)
    assert served["b"] == pytest.approx(80, abs=2)
    assert served["c"] == pytest.approx(160, abs=2)


@given(st.lists(st.floats(-1, 1e6), min_size=1, max_size=12))
def test_nobody_is_overtaken_more_often_than_it_says(news: list[float]) -> None:
    """Each other pair comes before at most 1 + MOST times, and once more as it stood when the wait began."""
    pairs = Pairs({chr(ord("a") + k): amount for k, amount in enumerate(news)})
    since = dict.fromkeys((pair[0] for pair in pairs.news), 0)
    for turn in range(1, 300):
        name = pairs.serve()
        assert turn - since[name] <= (2 + MOST) * len(news)
        since[name] = turn
    assert min(since.values()) > 299 - (2 + MOST) * len(news)


def test_newcomers_do_not_shut_out_who_waits() -> None:
    waiting, old = Waiting(), Plan(0.0)
    waiting.put(("old", "z"), old, 0.0)
    for number in range(100):
        pair = (f"n{number:03}", "z")
        plan = Plan(waiting.turn)
        waiting.put(pair, plan, MOST)
        taken = waiting.take()
        if taken == ("old", "z"):
            break
        assert taken == pair
        waiting.served(pair, plan, (HERE, HERE))
    assert number <= 1 + MOST


def test_more_news_brings_a_waiting_pair_forward_and_less_does_not_set_it_back() -> None:
    waiting = Waiting()
    one, other = Plan(0.0), Plan(0.0)
    waiting.put(("a", "b"), one, 1.0)
    waiting.put(("c", "d"), other, 0.5)
    waiting.put(("c", "d"), other, 2.0)
    waiting.put(("c", "d"), other, 0.0)
    assert len(waiting) == 2
    assert [waiting.take(), waiting.take(), waiting.take()] == [("c", "d"), ("a", "b"), None]


def test_who_is_dropped_is_not_taken() -> None:
    waiting = Waiting()
    for name in "ab":
        waiting.put((name, "z"), Plan(0.0), 0.0)
    waiting.drop(("a", "z"))
    assert ("a", "z") not in waiting
    assert [waiting.take(), waiting.take()] == [("b", "z"), None]


def test_what_was_put_again_and_again_leaves_no_heap_behind() -> None:
    waiting = Waiting()
    plans = {(name, "z"): Plan(0.0) for name in "abc"}
    for news in np.linspace(0, MOST, 5000):
        for pair, plan in plans.items():
            waiting.put(pair, plan, news)
    assert len(waiting._queue) < 100
    assert {waiting.take() for _ in range(3)} == set(plans)
    assert waiting.take() is None
