"""Each step merges the pair that loses least, and what is told of it is what its groups are worth."""

from itertools import pairwise

import numpy as np
import pytest
from covista_service.grouping import merging, scores
from covista_service.grouping.k_means import canonical
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.grouping.swarms import Floats, Labels, alike, jumbled, planted, reordered, scattered, together

STRANGER = 0.3
seeds, counts = st.integers(0, 10_000), st.integers(1, 14)
kinds = st.sampled_from([scattered, jumbled, lambda seed, count: jumbled(seed, count, 0.4)])


def parted(kind, seed: int, count: int) -> tuple[Floats, Floats, Labels]:
    """A similarity matrix, what robots expect, and a partition at random; every third has all alone."""
    rng = np.random.default_rng(seed)
    S = kind(seed, count)
    labels = np.unique(rng.integers(0, rng.integers(1, count + 1), count), return_inverse=True)[1]
    return S, scores.expectations(S, STRANGER, 0.7), labels if seed % 3 else np.arange(count)


def path(labels: Labels, steps: Labels) -> list[Labels]:
    """The partitions that steps lead through."""
    return [merging.after(labels, steps[:taken]) for taken in range(len(steps) + 1)]


@given(seed=seeds, count=counts, kind=kinds)
@settings(deadline=None)
def test_each_step_merges_the_pair_that_loses_least(seed: int, count: int, kind) -> None:
    S, expected, labels = parted(kind, seed, count)
    steps, gains = merging.merge_down(S, expected, labels, 1)
    for before, (into, out), gained in zip(path(labels, steps)[:-1], steps, gains, strict=True):
        alive = sorted(set(before.tolist()))
        worth = scores.gain(S, before, expected).sum()
        every = {
            (a, b): scores.gain(S, np.where(before == b, a, before), expected).sum() - worth
            for b in alive
            for a in alive
            if a < b
        }
        assert every[into, out] == pytest.approx(gained, abs=1e-9)
        assert gained >= max(every.values()) - 2e-9


@given(seed=seeds, count=counts, kind=kinds)
@settings(deadline=None)
def test_gains_are_differences_of_the_gain_of_groups(seed: int, count: int, kind) -> None:
    S, expected, labels = parted(kind, seed, count)
    steps, gains = merging.merge_down(S, expected, labels, 1)
    worth = [scores.gain(S, partition, expected).sum() for partition in path(labels, steps)]
    np.testing.assert_allclose(gains, np.diff(worth), rtol=0, atol=1e-10)


@given(seed=seeds, count=counts, kind=kinds)
@settings(deadline=None)
def test_silhouettes_are_those_of_the_groups_after_each_step(seed: int, count: int, kind) -> None:
    S, expected, labels = parted(kind, seed, count)
    steps, _ = merging.merge_down(S, expected, labels, 1)
    told = merging.silhouettes(S, labels, steps, STRANGER)
    dense = [np.unique(partition, return_inverse=True)[1] for partition in path(labels, steps)]
    anew = [scores.silhouette(S, partition, STRANGER).sum() for partition in dense]
    np.testing.assert_allclose(told, anew, rtol=0, atol=1e-12)


@given(seed=seeds, count=counts)
@settings(deadline=None)
def test_silhouettes_follow_any_steps(seed: int, count: int) -> None:
    S, _, labels = parted(jumbled, seed, count)
    rng = np.random.default_rng(seed)
    alive, chosen = list(range(int(labels.max()) + 1)), []
    while len(alive) > 1:
        into, out = rng.choice(alive, 2, replace=False).tolist()
        alive.remove(out)
        chosen.append((into, out))
    steps = np.array(chosen, np.intp).reshape(-1, 2)
    dense = [np.unique(partition, return_inverse=True)[1] for partition in path(labels, steps)]
    anew = [scores.silhouette(S, partition, STRANGER).sum() for partition in dense]
    np.testing.assert_allclose(merging.silhouettes(S, labels, steps, STRANGER), anew, rtol=0, atol=1e-12)


@given(seed=seeds, count=counts, data=st.data())
@settings(deadline=None)
def test_merging_ends_at_the_least_number_on_the_same_path(seed: int, count: int, data: st.DataObject) -> None:
    S, expected, labels = parted(jumbled, seed, count)
    formed = int(labels.max()) + 1
    least = data.draw(st.integers(1, formed))
    steps, gains = merging.merge_down(S, expected, labels, least)
    whole, _ = merging.merge_down(S, expected, labels, 1)
    assert len(gains) == len(steps) == formed - least
    np.testing.assert_array_equal(steps, whole[: len(steps)])
    assert len(set(merging.after(labels, steps).tolist())) == least


@given(seed=seeds, count=counts)
def test_groups_only_merge(seed: int, count: int) -> None:
    S, expected, labels = parted(jumbled, seed, count)
    steps, _ = merging.merge_down(S, expected, labels, 1)
    partitions = path(labels, steps)
    for before, after in pairwise(partitions):
        assert (together(after) >= together(before)).all()
        assert len(set(after.tolist())) == len(set(before.tolist())) - 1


@given(seed=seeds, count=st.integers(1, 30), kind=kinds)
@settings(deadline=None)
def test_the_order_of_robots_does_not_matter(seed: int, count: int, kind) -> None:
    S, expected, labels = parted(kind, seed, count)
    order = np.random.default_rng(seed).permutation(count)
    found = path(labels, merging.merge_down(S, expected, labels, 1)[0])
    moved = canonical(labels[order], count)
    shuffled = path(moved, merging.merge_down(reordered(S, order), expected[order], moved, 1)[0])
    for one, other in zip(found, shuffled, strict=True):
        np.testing.assert_array_equal(together(one)[np.ix_(order, order)], together(other))


def test_all_that_was_planted_merges_before_anything_else_does() -> None:
    S, truth = planted(3, (4, 5, 2, 6))
    expected = scores.expectations(S, STRANGER, 0.7)
    steps, gains = merging.merge_down(S, expected, np.arange(len(S)), 1)
    np.testing.assert_array_equal(together(merging.after(np.arange(len(S)), steps[:-3])), together(truth))
    assert (gains[-3:] < 0).all()


@pytest.mark.parametrize("S", [np.ones((5, 5)), np.eye(5), alike(5, 0.5)], ids=["in one place", "apart", "all alike"])
def test_robots_that_nothing_tells_apart_merge_all_the_same(S: Floats) -> None:
    steps, gains = merging.merge_down(S, scores.expectations(S, STRANGER, 0.7), np.arange(5), 1)
    assert (merging.after(np.arange(5), steps) == 0).all()
    assert np.isfinite(gains).all()
    assert np.isfinite(merging.silhouettes(S, np.arange(5), steps, STRANGER)).all()
