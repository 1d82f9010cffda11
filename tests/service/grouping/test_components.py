"""Who hangs together over links above a threshold is one group, unless bounds demand more or fewer."""

import numpy as np
import pytest
from covista_service.grouping.bounds import Bounds
from covista_service.grouping.components import components
from covista_service.grouping.k_means import canonical
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.grouping.swarms import Floats, Labels, alike, jumbled, planted, reordered, together

seeds, counts, thresholds = st.integers(0, 10_000), st.integers(1, 14), st.floats(0, 1)
FREE = Bounds()


def linked(S: Floats, links: list[tuple[int, int]]) -> Labels:
    """Union-find: who hangs together over links."""
    parent = list(range(len(S)))

    def root(i: int) -> int:
        while parent[i] != i:
            i = parent[i]
        return i

    for i, j in links:
        parent[root(i)] = root(j)
    return np.array([root(i) for i in range(len(S))], np.intp)


def ranked(S: Floats) -> list[tuple[int, int]]:
    """All pairs, the strongest link first."""
    return sorted(((i, j) for i in range(len(S)) for j in range(i)), key=lambda pair: -S[pair])


def above(S: Floats, threshold: float) -> list[tuple[int, int]]:
    return [pair for pair in ranked(S) if S[pair] > threshold]


@given(seed=seeds, count=counts, threshold=thresholds)
@settings(deadline=None)
def test_groups_are_what_hangs_together_over_links_above_the_threshold(seed: int, count: int, threshold: float) -> None:
    S = jumbled(seed, count)
    labels = components(S, threshold, FREE)
    np.testing.assert_array_equal(together(labels), together(linked(S, above(S, threshold))))
    np.testing.assert_array_equal(labels, canonical(labels, count))


@given(seed=seeds, count=counts, tenths=st.integers(0, 10))
@settings(deadline=None)
def test_a_link_as_strong_as_the_threshold_is_none(seed: int, count: int, tenths: int) -> None:
    S = np.round(jumbled(seed, count), 1)
    expected = linked(S, above(S, tenths / 10))
    np.testing.assert_array_equal(together(components(S, tenths / 10, FREE)), together(expected))


@given(seed=seeds, count=counts, threshold=thresholds, data=st.data())
@settings(deadline=None)
def test_the_strongest_links_decide_which_groups_bounds_make_of_them(seed: int, count: int, threshold, data) -> None:
    least = data.draw(st.integers(1, count))
    largest = data.draw(st.integers(least, count))
    S = jumbled(seed, count)
    free = linked(S, above(S, threshold))
    wanted = min(max(len(set(free.tolist())), least), largest)
    # So many of the strongest links as leave that number of groups.
    pairs = ranked(S)
    expected = next(
        groups for taken in range(len(pairs) + 1) if len(set((groups := linked(S, pairs[:taken])).tolist())) == wanted
    )
    labels = components(S, threshold, Bounds((least, largest)))
    np.testing.assert_array_equal(together(labels), together(expected))
    assert labels.max() + 1 == wanted
    np.testing.assert_array_equal(components(S, threshold, Bounds((wanted, wanted))), labels)
    np.testing.assert_array_equal(components(S, threshold, Bounds(wanted)), labels)


@given(seed=seeds, count=counts, threshold=thresholds, size=st.integers(1, 4), least=st.integers(1, 4))
@settings(deadline=None)
def test_groups_are_as_large_as_they_must_be(seed: int, count: int, threshold: float, size: int, least: int) -> None:
    bounds = Bounds((least, count), size) if least <= count else Bounds(least, size)
    if bounds.refusal(count) is not None:
        with pytest.raises(ValueError, match="cannot form"):
            components(jumbled(seed, count), threshold, bounds)
        return
    labels = components(jumbled(seed, count), threshold, bounds)
    sizes = np.bincount(labels)
    assert sizes.min() >= size
    assert least <= len(sizes)
    np.testing.assert_array_equal(labels, canonical(labels, count))


@given(seed=seeds, count=counts, threshold=thresholds, size=st.integers(1, 3))
@settings(deadline=None)
def test_the_order_of_robots_does_not_matter(seed: int, count: int, threshold: float, size: int) -> None:
    S, order = jumbled(seed, count), np.random.default_rng(seed).permutation(count)
    bounds = Bounds("auto", min(size, count))
    shuffled = components(reordered(S, order), threshold, bounds)
    np.testing.assert_array_equal(reordered(together(components(S, threshold, bounds)), order), together(shuffled))


@pytest.mark.parametrize("weight", [0.1, 0.3, 0.7, 1.0])
def test_all_in_one_and_all_apart(weight: float) -> None:
    S = alike(6, weight)
    np.testing.assert_array_equal(components(S, weight - 1e-12, FREE), np.zeros(6))
    np.testing.assert_array_equal(components(S, weight, FREE), np.arange(6))


def test_a_chain_of_links_is_one_group() -> None:
    S = np.eye(5) + 0.6 * (np.eye(5, k=1) + np.eye(5, k=-1))
    np.testing.assert_array_equal(components(S, 0.5, FREE), np.zeros(5))
    np.testing.assert_array_equal(components(np.eye(5), 0.0, FREE), np.arange(5))


def test_planted_groups_are_found_in_a_large_swarm() -> None:
    S, truth = planted(6, (100, 150, 1, 49))
    np.testing.assert_array_equal(together(components(S, 0.5, FREE)), together(truth))


@pytest.mark.parametrize("count", [0, 1])
def test_nobody_and_one_alone(count: int) -> None:
    np.testing.assert_array_equal(components(np.ones((count, count)), 0.5, FREE), np.zeros(count))
