"""Ng-Jordan-Weiss: exact number of groups, no chance, no dependence on the order of robots."""

from collections.abc import Iterator

import numpy as np
import pytest
from covista_service.grouping.spectral import MAX_STARTS, Spectrum, canonical, partition
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.service.grouping.swarms import Floats, planted, scattered, together


def labels_of(S: Floats, m: int) -> NDArray[np.intp]:
    return partition(Spectrum.of(S), m)


def partitions(count: int, m: int) -> Iterator[NDArray[np.intp]]:
    """All partitions of `count` robots into m groups: restricted growth strings."""

    def grow(prefix: list[int]) -> Iterator[list[int]]:
        used = max(prefix) + 1
        if m - used > count - len(prefix):
            return
        if len(prefix) == count:
            yield prefix
            return
        for label in range(min(used + 1, m)):
            yield from grow([*prefix, label])

    return (np.array(labels) for labels in grow([0]))


def normalised_cut(S: Floats, labels: NDArray[np.intp]) -> float:
    member = labels == np.unique(labels)[:, None]
    volume = member @ S.sum(axis=1)
    inside = np.array([S[np.ix_(group, group)].sum() for group in member])
    return float(((volume - inside) / volume).sum())


@pytest.mark.parametrize(("sizes", "seed"), [((3, 3), 0), ((2, 4, 3), 1), ((4, 1, 3), 2), ((2, 2, 3, 3), 3)])
def test_planted_groups_have_the_least_normalised_cut_of_all_partitions(sizes: tuple[int, ...], seed: int) -> None:
    S, truth = planted(seed, sizes)
    found = labels_of(S, len(sizes))
    best = min(partitions(len(S), len(sizes)), key=lambda labels: normalised_cut(S, labels))
    np.testing.assert_array_equal(together(found), together(truth))
    np.testing.assert_array_equal(together(found), together(best))


def test_scattered_robots_come_close_to_the_least_normalised_cut() -> None:
    excess = []
    for seed in range(12):
        S = scattered(seed, 8)
        for m in (2, 3):
            least = min(normalised_cut(S, labels) for labels in partitions(8, m))
            excess.append(normalised_cut(S, labels_of(S, m)) / least - 1)
    assert np.median(excess) < 0.01
    assert max(excess) < 0.2


@given(seed=st.integers(0, 10_000), count=st.integers(2, 14), data=st.data())
@settings(max_examples=60, deadline=None)
def test_the_order_of_robots_does_not_matter(seed: int, count: int, data: st.DataObject) -> None:
    S = scattered(seed, count)
    m = data.draw(st.integers(1, count))
    order = np.array(data.draw(st.permutations(range(count))))
    shuffled = labels_of(S[np.ix_(order, order)], m)
    np.testing.assert_array_equal(together(labels_of(S, m))[np.ix_(order, order)], together(shuffled))


@given(seed=st.integers(0, 10_000), count=st.integers(1, 16))
@settings(max_examples=40, deadline=None)
def test_every_number_of_groups_comes_out_exactly_and_labelled_by_first_robot(seed: int, count: int) -> None:
    spectrum = Spectrum.of(scattered(seed, count))
    for m in range(1, count + 1):
        labels = partition(spectrum, m)
        assert sorted(set(labels.tolist())) == list(range(m))
        np.testing.assert_array_equal(labels, canonical(labels))
        np.testing.assert_array_equal(labels, partition(spectrum, m))


@pytest.mark.parametrize("S", [np.ones((5, 5)), np.eye(5)], ids=["all alike", "nothing in common"])
def test_robots_that_nothing_tells_apart_are_still_parted_as_asked(S: Floats) -> None:
    for m in range(1, 6):
        assert len(set(labels_of(S, m).tolist())) == m


def test_a_weakly_tied_robot_can_stand_alone() -> None:
    S = np.full((5, 5), 0.8)
    S[4, :4] = S[:4, 4] = 0.05
    np.fill_diagonal(S, 1.0)
    np.testing.assert_array_equal(labels_of(S, 2), [0, 0, 0, 0, 1])


def test_a_large_swarm_is_seeded_from_some_of_its_robots() -> None:
    S, truth = planted(5, (60, 90, MAX_STARTS - 100))
    np.testing.assert_array_equal(together(labels_of(S, 3)), together(truth))


def test_more_groups_than_robots_cannot_be() -> None:
    with pytest.raises(ValueError, match="3 robots cannot form 4 groups"):
        labels_of(np.eye(3), 4)


@pytest.mark.parametrize("S", [np.zeros((0, 0)), np.zeros((2, 3)), np.zeros(4)])
def test_what_is_not_a_matrix_of_robots_is_refused(S: Floats) -> None:
    with pytest.raises(ValueError, match="square and not empty"):
        Spectrum.of(S)


def test_labels_become_canonical_in_the_order_of_first_robots() -> None:
    np.testing.assert_array_equal(canonical(np.array([7, 2, 7, 5, 2])), [0, 1, 0, 2, 1])
