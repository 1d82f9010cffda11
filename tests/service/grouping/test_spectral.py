"""Ng-Jordan-Weiss: exact number of groups, no chance, no dependence on the order of robots."""

import numpy as np
import pytest
from covista_service.grouping.k_means import canonical
from covista_service.grouping.spectral import MAX_STARTS, PARTIAL_FROM, PARTIAL_SHARE, Spectrum, partition
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.grouping.swarms import (
    Floats,
    Labels,
    alike,
    jumbled,
    members,
    partitions,
    planted,
    reordered,
    scattered,
    together,
)


def labels_of(S: Floats, m: int) -> Labels:
    return partition(Spectrum.of(S), m)


def normalised_cuts(S: Floats, labels: Labels) -> Floats:
    """Of partitions (P, N): the share of each group's ties that leads out of it, summed."""
    member = members(labels)
    volume = member @ S.sum(axis=1)
    inside = ((member @ S) * member).sum(axis=-1)
    return ((volume - inside) / volume).sum(axis=-1)


@pytest.mark.parametrize(
    ("sizes", "seed"),
    [((3, 3), 0), ((2, 4, 3), 1), ((4, 1, 3), 2), ((2, 2, 3, 3), 3), ((5, 5), 4), ((1, 2, 1, 2, 3), 5), ((1, 9), 6)],
)
def test_planted_groups_have_the_least_normalised_cut_of_all_partitions(sizes: tuple[int, ...], seed: int) -> None:
    S, truth = planted(seed, sizes)
    found = labels_of(S, len(sizes))
    every = partitions(len(S), len(sizes))
    best = every[normalised_cuts(S, every).argmin()]
    np.testing.assert_array_equal(together(found), together(truth))
    np.testing.assert_array_equal(together(found), together(best))


@pytest.mark.parametrize("m", [2, 3, 4])
def test_scattered_robots_come_close_to_the_least_normalised_cut(m: int) -> None:
    excess = []
    for seed in range(30):
        S = scattered(seed, 8)
        least = normalised_cuts(S, partitions(8, m)).min()
        excess.append(normalised_cuts(S, labels_of(S, m)) / least - 1)
    assert min(excess) > -1e-9
    assert np.median(excess) < 0.01
    assert max(excess) < 0.2


@given(
    seed=st.integers(0, 10_000), count=st.integers(2, 60), data=st.data(), kind=st.sampled_from([scattered, jumbled])
)
@settings(max_examples=60, deadline=None)
def test_the_order_of_robots_does_not_matter(seed: int, count: int, data: st.DataObject, kind) -> None:
    S = kind(seed, count)
    m = data.draw(st.integers(1, count))
    order = np.random.default_rng(seed).permutation(count)
    shuffled = labels_of(reordered(S, order), m)
    np.testing.assert_array_equal(reordered(together(labels_of(S, m)), order), together(shuffled))


@given(seed=st.integers(0, 10_000), count=st.integers(1, 16), kind=st.sampled_from([scattered, jumbled]))
@settings(max_examples=40, deadline=None)
def test_every_number_of_groups_comes_out_exactly_and_labelled_by_first_robot(seed: int, count: int, kind) -> None:
    spectrum = Spectrum.of(kind(seed, count))
    assert spectrum.most == count
    for m in range(1, count + 1):
        labels = partition(spectrum, m)
        assert sorted(set(labels.tolist())) == list(range(m))
        np.testing.assert_array_equal(labels, canonical(labels, m))


@pytest.mark.parametrize("count", [12, MAX_STARTS + 1, PARTIAL_FROM + 10])
@pytest.mark.parametrize("S", [scattered, jumbled, lambda _, count: np.ones((count, count))])
def test_the_same_matrix_gives_the_same_groups_to_the_last_bit(S, count: int) -> None:
    first, second = (Spectrum.of(S(5, count), 8) for _ in range(2))
    np.testing.assert_array_equal(first.vectors, second.vectors)
    np.testing.assert_array_equal(first.values, second.values)
    np.testing.assert_array_equal(partition(first, 8), partition(second, 8))


@given(seed=st.integers(0, 10_000), count=st.integers(1, 30))
@settings(max_examples=30, deadline=None)
def test_a_spectrum_is_one(seed: int, count: int) -> None:
    S = scattered(seed, count)
    spectrum = Spectrum.of(S)
    scale = 1 / np.sqrt(S.sum(axis=1))
    normalised = scale[:, None] * S * scale
    np.testing.assert_allclose(normalised @ spectrum.vectors, spectrum.vectors * spectrum.values, atol=1e-12)
    assert (np.diff(spectrum.values) <= 0).all()
    # Who belongs together how much, all in all, is the first eigenvector: its value is 1.
    assert spectrum.values[0] == pytest.approx(1.0)
    np.testing.assert_allclose(spectrum.degree, S.sum(axis=1))
    for m in range(1, count + 1):
        np.testing.assert_allclose(np.linalg.norm(spectrum.rows(m), axis=1), 1.0)


def test_a_row_of_zeros_stays() -> None:
    rows = Spectrum(np.array([[0.0, 3.0], [2.0, 0.0]]), np.ones(2), np.ones(2)).rows(1)
    np.testing.assert_array_equal(rows, [[0.0], [1.0]])


@pytest.mark.parametrize("S", [np.ones((5, 5)), np.eye(5), alike(5, 0.5)], ids=["in one place", "apart", "all alike"])
def test_robots_that_nothing_tells_apart_are_still_parted_as_asked(S: Floats) -> None:
    for m in range(1, 6):
        assert len(set(labels_of(S, m).tolist())) == m


def test_a_weakly_tied_robot_can_stand_alone() -> None:
    S = alike(5, 0.8)
    S[4, :4] = S[:4, 4] = 0.05
    np.testing.assert_array_equal(labels_of(S, 2), [0, 0, 0, 0, 1])


def test_a_large_swarm_is_seeded_from_some_of_its_robots() -> None:
    S, truth = planted(5, (60, 90, MAX_STARTS - 40))
    np.testing.assert_array_equal(together(labels_of(S, 3)), together(truth))


@pytest.mark.parametrize("count", [PARTIAL_FROM, 300])
@pytest.mark.parametrize("m", [2, 5, int(PARTIAL_SHARE * PARTIAL_FROM)])
@pytest.mark.parametrize("across", [0.0, 1e-15, 0.3], ids=["nothing in common", "next to nothing", "much in common"])
def test_a_few_eigenvectors_part_as_all_do(count: int, m: int, across: float) -> None:
    sizes = np.bincount(np.arange(count) % m)
    S, truth = planted(m, tuple(sizes.tolist()), (0.3, 0.9), (0.0, across))
    few, every = Spectrum.of(S, m), Spectrum.of(S)
    assert few.most == m
    assert every.most == count
    np.testing.assert_allclose(few.values, every.values[:m], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(together(partition(few, m)), together(truth))
    np.testing.assert_array_equal(partition(few, m), partition(every, m))


@pytest.mark.parametrize("m", [2, 3, 20])
def test_a_few_eigenvectors_part_scattered_robots_as_all_do(m: int) -> None:
    S = scattered(m, 250)
    np.testing.assert_array_equal(partition(Spectrum.of(S, m), m), labels_of(S, m))


@pytest.mark.parametrize("m", [-1, 0, 4])
def test_a_number_of_groups_that_cannot_be_is_refused(m: int) -> None:
    with pytest.raises(ValueError, match=f"3 robots cannot form {m} groups"):
        labels_of(np.eye(3), m)


def test_more_groups_than_eigenvectors_serve_are_refused() -> None:
    with pytest.raises(ValueError, match="these eigenvectors serve up to 3 groups, not 4"):
        partition(Spectrum.of(scattered(1, PARTIAL_FROM), 3), 4)


@pytest.mark.parametrize("S", [np.zeros((0, 0)), np.zeros((2, 3)), np.zeros(4)])
def test_what_is_not_a_matrix_of_robots_is_refused(S: Floats) -> None:
    with pytest.raises(ValueError, match="square and not empty"):
        Spectrum.of(S)
