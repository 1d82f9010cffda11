"""Where local moves end nobody gains by moving, whatever the order of robots and however they began."""

import numpy as np
import pytest
from covista_service.grouping import scores
from covista_service.grouping.k_means import canonical
from covista_service.grouping.moves import settle
from covista_service.grouping.selection import GAIN
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.grouping.swarms import (
    Floats,
    Labels,
    alike,
    all_partitions,
    jumbled,
    members,
    planted,
    reordered,
    scattered,
    together,
)

STRANGER = 0.3
# A gain below this is rounding.
LEAST = 2e-9
seeds, demands = st.integers(0, 10_000), st.sampled_from([0.5, 0.65, 0.7, 0.9])


def sparse(seed: int, count: int) -> Floats:
    """Robots many of whom have next to nothing in common with anybody, and expect as little as the others."""
    return jumbled(seed, count, 0.5)


kinds = st.sampled_from([scattered, jumbled, sparse])


def begun(seed: int, count: int) -> Labels:
    """Groups at random to begin with, or all alone."""
    rng = np.random.default_rng(seed)
    return rng.integers(0, count, count) if seed % 2 else np.arange(count)


def gains(S: Floats, expected: Floats, labels: Labels) -> Floats:
    """Of partitions (P, N): what pairs inside groups exceed expectations by."""
    worth = S - (expected[:, None] + expected) / 2
    np.fill_diagonal(worth, 0.0)
    member = members(labels)
    return ((member @ worth) * member).sum(axis=(-1, -2)) / 2


def neighbours(labels: Labels) -> list[Labels]:
    """All partitions that are one robot's move or one merger away."""
    m = int(labels.max()) + 1
    moved = []
    for i in range(len(labels)):
        for group in range(m + 1):
            other = labels.copy()
            other[i] = group
            moved.append(other)
    return moved + [np.where(labels == a, b, labels) for a in range(m) for b in range(a)]


@given(seed=seeds, count=st.integers(1, 14), demand=demands, kind=kinds)
@settings(deadline=None)
def test_nobody_gains_by_moving_and_no_two_groups_by_merging(seed: int, count: int, demand: float, kind) -> None:
    S = kind(seed, count)
    expected = scores.expectations(S, STRANGER, demand)
    labels = settle(S, expected, begun(seed, count))
    reached = scores.gain(S, labels, expected).sum()
    assert reached >= scores.gain(S, begun(seed, count), expected).sum() - LEAST
    assert max(scores.gain(S, other, expected).sum() for other in neighbours(labels)) <= reached + LEAST


@given(seed=seeds, count=st.integers(0, 40), demand=demands, kind=kinds)
@settings(deadline=None)
def test_who_has_settled_stays_and_is_numbered_by_first_robots(seed: int, count: int, demand: float, kind) -> None:
    S = kind(seed, count)
    expected = scores.expectations(S, STRANGER, demand)
    labels = settle(S, expected, begun(seed, count))
    np.testing.assert_array_equal(labels, canonical(labels, count))
    np.testing.assert_array_equal(settle(S, expected, labels), labels)
    # Nor do the numbers of the groups to begin with matter.
    np.testing.assert_array_equal(settle(S, expected, count - 1 - labels), labels)


@given(seed=seeds, count=st.integers(0, 40))
@settings(deadline=None)
def test_the_start_is_left_as_it_was(seed: int, count: int) -> None:
    S, start = jumbled(seed, count), begun(seed, count)
    settle(S, scores.expectations(S, STRANGER, 0.65), start)
    np.testing.assert_array_equal(start, begun(seed, count))


@given(seed=seeds, count=st.integers(1, 40), demand=demands, kind=kinds)
@settings(deadline=None)
def test_the_order_of_robots_does_not_matter(seed: int, count: int, demand: float, kind) -> None:
    S, start = kind(seed, count), begun(seed, count)
    order = np.random.default_rng(seed).permutation(count)
    labels = settle(S, scores.expectations(S, STRANGER, demand), start)
    moved = reordered(S, order)
    shuffled = settle(moved, scores.expectations(moved, STRANGER, demand), start[order])
    np.testing.assert_array_equal(reordered(together(labels), order), together(shuffled))


@pytest.mark.parametrize("sizes", [(3, 3), (1, 5, 2), (4, 4, 4, 1), (30, 20, 10)])
@pytest.mark.parametrize("demand", [0.5, 0.65, 0.7])
def test_planted_groups_are_found(sizes: tuple[int, ...], demand: float) -> None:
    S, truth = planted(7, sizes)
    expected = scores.expectations(S, STRANGER, demand)
    for start in (np.arange(len(S)), np.zeros(len(S), np.intp), begun(1, len(S))):
        np.testing.assert_array_equal(together(settle(S, expected, start)), together(truth))


@pytest.mark.parametrize(("weight", "groups"), [(0.0, 5), (0.2, 5), (0.31, 1), (1.0, 1)])
def test_all_alike_are_together_if_they_have_more_in_common_than_strangers(weight: float, groups: int) -> None:
    S = alike(5, weight)
    assert settle(S, scores.expectations(S, STRANGER, 0.65), np.arange(5)).max() + 1 == groups


def hazy(seed: int, count: int) -> Floats:
    """Three groups that have much in common."""
    return planted(seed, (count - 5, 3, 2), (0.3, 0.8), (0.0, 0.5))[0]


# Measured over 400 such swarms of 8 robots each, from all alone: scattered never miss the best partition, hazy .5 %,
# jumbled 15 %, sparse 18 %; those lose 3 to 7 % of the gain at the median.
@pytest.mark.parametrize(
    ("kind", "missed", "lost"), [(scattered, 0.05, 0.01), (hazy, 0.05, 0.01), (jumbled, 0.3, 0.02), (sparse, 0.3, 0.03)]
)
def test_the_gain_comes_close_to_the_best_of_all_partitions(kind, missed: float, lost: float) -> None:
    short = []
    for seed in range(100):
        S = kind(seed, 8)
        expected = scores.expectations(S, STRANGER, GAIN)
        best = gains(S, expected, all_partitions(8)).max()
        reached = scores.gain(S, settle(S, expected, np.arange(8)), expected).sum()
        assert reached <= best + 1e-9
        short.append((best - reached) / best if best > 1e-9 else 0.0)
    assert np.mean(np.array(short) > 1e-9) < missed
    assert np.mean(short) < lost
