"""k-means of unit rows against all partitions; exact numbers, no chance, no dependence on the order of rows."""

import numpy as np
import pytest
from covista_service.grouping.k_means import canonical, k_means
from covista_service.grouping.spectral import Spectrum
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.grouping.swarms import Floats, Labels, jumbled, members, partitions, planted, scattered, together

seeds = st.integers(0, 10_000)


def costs(rows: Floats, labels: Labels) -> Floats:
    """Of partitions (P, N): squared distances of rows to the means of their groups, summed."""
    member = members(labels)
    sums = member @ rows
    return (rows**2).sum() - ((sums**2).sum(axis=-1) / member.sum(axis=-1)).sum(axis=-1)


def unit_rows(seed: int, count: int, m: int) -> Floats:
    rows = np.random.default_rng(seed).normal(size=(count, m))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def every(count: int) -> Labels:
    return np.arange(count)


def few(count: int) -> Labels:
    return np.arange(0, count, 2)


def excess(S: Floats, m: int, starts: Labels) -> float:
    """By how much more than the least of all partitions the rows' cost is."""
    rows = Spectrum.of(S).rows(m)
    least = float(costs(rows, partitions(len(S), m)).min())
    found = float(costs(rows, k_means(rows, m, starts)))
    assert found > least - 1e-9
    return (found - least) / least


def hazy(seed: int, count: int) -> Floats:
    """Three groups that have much in common."""
    return planted(seed, (count - 5, 3, 2), (0.3, 0.8), (0.0, 0.5))[0]


# Measured over 3 600 such swarms of 6 to 8 robots: 4 % of the scattered, 5 % of the hazy and 12 % of the jumbled miss
# the least cost from every start, and then by a tenth at the median; from half of the starts 5, 7 and 14 %.
@pytest.mark.parametrize("starts", [every, few])
@pytest.mark.parametrize(("kind", "missed"), [(scattered, 0.09), (hazy, 0.11), (jumbled, 0.2)])
def test_the_least_cost_of_all_partitions_is_rarely_missed(kind, missed: float, starts) -> None:
    found = np.array(
        [excess(kind(seed, count), m, starts(count)) for seed in range(40) for count in (6, 8) for m in (2, 3, 4)]
    )
    assert np.mean(found > 1e-6) < missed
    assert np.median(found) < 1e-9
    assert np.mean(found) < 0.035


@pytest.mark.parametrize("starts", [every, few])
@pytest.mark.parametrize("sizes", [(4, 4), (3, 3, 2), (1, 3, 4), (2, 2, 2, 2)])
def test_the_least_cost_of_as_many_groups_as_were_planted_is_never_missed(sizes: tuple[int, ...], starts) -> None:
    for seed in range(20):
        S, truth = planted(seed, sizes)
        assert excess(S, len(sizes), starts(len(S))) < 1e-9
        rows = Spectrum.of(S).rows(len(sizes))
        np.testing.assert_array_equal(together(k_means(rows, len(sizes), starts(len(S)))), together(truth))


@given(seed=seeds, count=st.integers(1, 40), data=st.data())
@settings(deadline=None)
def test_no_row_lies_nearer_to_another_mean(seed: int, count: int, data: st.DataObject) -> None:
    m = data.draw(st.integers(1, count))
    rows = unit_rows(seed, count, m)
    labels = k_means(rows, m, every(count))
    assert sorted(set(labels.tolist())) == list(range(m))
    member = members(labels)
    means = member @ rows / member.sum(axis=-1, keepdims=True)
    distance = np.linalg.norm(rows[:, None] - means, axis=2)
    assert (distance[np.arange(count), labels] <= distance.min(axis=1) + 1e-9).all()


@given(seed=seeds, count=st.integers(1, 40), data=st.data())
@settings(deadline=None)
def test_the_order_of_rows_does_not_matter(seed: int, count: int, data: st.DataObject) -> None:
    m = data.draw(st.integers(1, min(count, 8)))
    rows = unit_rows(seed, count, m)
    order = np.random.default_rng(seed).permutation(count)
    shuffled = k_means(rows[order], m, every(count))
    np.testing.assert_array_equal(together(k_means(rows, m, every(count))[order]), together(shuffled))


@given(seed=seeds, count=st.integers(2, 40), data=st.data())
@settings(deadline=None)
def test_the_order_of_starts_and_the_signs_of_eigenvectors_do_not_matter(seed: int, count: int, data) -> None:
    m = data.draw(st.integers(1, min(count, 8)))
    rows, rng = unit_rows(seed, count, m), np.random.default_rng(seed)
    mirrored = rows * rng.choice([-1.0, 1.0], m)
    found = k_means(rows, m, every(count))
    np.testing.assert_array_equal(found, k_means(mirrored, m, rng.permutation(count)))


@given(seed=seeds, count=st.integers(1, 12), kinds=st.integers(1, 3), data=st.data())
@settings(deadline=None)
def test_equal_rows_and_rows_of_zeros_are_parted_as_asked(seed: int, count: int, kinds: int, data) -> None:
    m = data.draw(st.integers(1, count))
    rng = np.random.default_rng(seed)
    palette = np.concatenate([unit_rows(seed, kinds, m), np.zeros((1, m))])
    labels = k_means(palette[rng.integers(0, kinds + 1, count)], m, every(count))
    assert sorted(set(labels.tolist())) == list(range(m))


def test_a_group_that_would_be_empty_takes_the_row_that_fits_worst() -> None:
    # Seeds are the first row and one of its twins; the third row is alone in its direction.
    rows = np.array([[1.0, 0.0], [1.0, 0.0], [0.8, 0.6], [1.0, 0.0]])
    np.testing.assert_array_equal(k_means(rows, 2, every(4)), [0, 0, 1, 0])


def test_a_group_of_one_row_is_not_robbed() -> None:
    # From the first row, seeds are it and its neighbours, all alike: two of their groups are empty, and one robot is
    # to spare beside the first.
    first, second = np.eye(2, 4)
    rows = np.array([first, second, second, second, -second])
    labels = k_means(rows, 4, np.zeros(1, np.intp))
    assert sorted(set(labels.tolist())) == [0, 1, 2, 3]
    assert labels[0] not in labels[1:]
    assert labels[4] not in labels[:4]


@given(labels=st.lists(st.integers(0, 9), max_size=20))
def test_labels_become_canonical_in_the_order_of_first_robots(labels: list[int]) -> None:
    renamed = canonical(np.array(labels, np.intp), 10).tolist()
    first = {label: number for number, label in enumerate(dict.fromkeys(labels))}
    assert renamed == [first[label] for label in labels]
