import gc
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from covista_service.perception.camera import Features
from covista_service.workers.shipped import Shipped
from hypothesis import given
from hypothesis import strategies as st


def features() -> Features:
    return Features("orb", np.zeros((1, 2), np.float32), np.zeros((1, 32), np.uint8))


def test_a_place_is_known_for_as_long_as_its_features_live() -> None:
    shipped: Shipped[str] = Shipped()
    held, dropped = features(), features()
    shipped.add(held, "here")
    shipped.add(dropped, "there")
    assert (shipped.find(held), shipped.find(dropped)) == ("here", "there")
    assert shipped.released() == []
    del dropped
    gc.collect()
    assert shipped.released() == ["there"]
    assert shipped.released() == []
    assert (len(shipped), shipped.find(held)) == (1, "here")


def test_equal_features_are_not_the_same() -> None:
    shipped: Shipped[str] = Shipped()
    one = features()
    shipped.add(one, "here")
    assert shipped.find(features()) is None
    assert len(shipped) == 1


def test_what_is_shipped_again_leaves_its_former_place() -> None:
    shipped: Shipped[str] = Shipped()
    one = features()
    shipped.add(one, "first")
    shipped.add(one, "second")
    assert shipped.find(one) == "second"
    assert shipped.released() == ["first"]
    del one
    gc.collect()
    assert shipped.released() == ["second"]


def test_features_may_go_in_any_thread() -> None:
    shipped: Shipped[int] = Shipped()
    held = [features() for _ in range(100)]
    for number, one in enumerate(held):
        shipped.add(one, number)
    del one
    with ThreadPoolExecutor(4) as threads:
        list(threads.map(lambda _: held.pop() and None, range(100)))
    gc.collect()
    assert sorted(shipped.released()) == list(range(100))
    assert len(shipped) == 0


@given(st.lists(st.sampled_from(["add", "drop", "ask"]), max_size=60))
def test_every_place_is_either_held_or_released_once(steps: list[str]) -> None:
    """New features often lie at the address of old ones: that must not confuse them."""
    shipped: Shipped[int] = Shipped()
    held: list[tuple[Features, int]] = []
    released: list[int] = []
    count = 0
    for step in steps:
        if step == "add":
            held.append((features(), count))
            assert shipped.find(held[-1][0]) is None
            shipped.add(*held[-1])
            count += 1
        elif step == "drop" and held:
            held.pop(0)
        elif step == "ask":
            released += shipped.released()
    released += shipped.released()
    assert sorted(released + [number for _, number in held]) == list(range(count))
    assert all(shipped.find(one) == number for one, number in held)
