"""What bounds admit, what they refuse and in which words, and groups that are made to keep them."""

import numpy as np
import pytest
from covista_service.grouping.bounds import Bounds, Groups, with_least_size
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.service.grouping.swarms import Floats, Labels, alike, jumbled, planted, reordered, together

seeds = st.integers(0, 10_000)
pairs = st.tuples(st.integers(1, 12), st.integers(0, 12)).map(lambda pair: (pair[0], pair[0] + pair[1]))
all_bounds = st.builds(Bounds, st.just("auto") | st.integers(1, 12) | pairs, st.integers(1, 6))


@pytest.mark.parametrize(
    ("groups", "size", "count", "numbers"),
    [
        ("auto", 1, 7, range(1, 8)),
        ("auto", 2, 7, range(1, 4)),
        ("auto", 7, 7, range(1, 2)),
        (3, 1, 7, range(3, 4)),
        (7, 1, 7, range(7, 8)),
        ((2, 4), 1, 7, range(2, 5)),
        ((3, 99), 1, 7, range(3, 8)),
        ((2, 99), 2, 7, range(2, 4)),
        ((2, 2), 3, 7, range(2, 3)),
        ("auto", 1, 1, range(1, 2)),
    ],
)
def test_numbers_are_those_asked_for_that_so_many_robots_can_form(groups: Groups, size: int, count: int, numbers):
    assert Bounds(groups, size).numbers(count) == numbers
    assert Bounds(groups, size).refusal(count) is None


@pytest.mark.parametrize(
    ("groups", "size", "count", "sentence"),
    [
        (0, 1, 4, "4 robots cannot form 0 groups"),
        (-1, 1, 4, "4 robots cannot form -1 groups"),
        (5, 1, 4, "4 robots cannot form 5 groups"),
        (2, 1, 1, "1 robot cannot form 2 groups"),
        ((5, 9), 1, 4, "4 robots cannot form 5 groups"),
        ((0, 3), 1, 4, "bounds on the number of groups are 1 <= least <= largest, not 0 and 3"),
        ((3, 2), 1, 4, "bounds on the number of groups are 1 <= least <= largest, not 3 and 2"),
        ("auto", 0, 4, "a group has at least one robot, not 0"),
        ("auto", -3, 4, "a group has at least one robot, not -3"),
        ("auto", 5, 4, "4 robots cannot form 1 group of at least 5"),
        ("auto", 2, 1, "1 robot cannot form 1 group of at least 2"),
        (2, 3, 5, "5 robots cannot form 2 groups of at least 3"),
        ((2, 4), 3, 5, "5 robots cannot form 2 groups of at least 3"),
        ("auto", 1, 0, "0 robots cannot form 1 groups"),
    ],
)
def test_bounds_that_no_grouping_satisfies_are_refused_and_say_why(groups: Groups, size, count, sentence: str) -> None:
    bounds = Bounds(groups, size)
    assert bounds.refusal(count) == sentence
    with pytest.raises(ValueError, match=f"^{sentence}$"):
        bounds.numbers(count)


@given(bounds=all_bounds, count=st.integers(1, 30))
def test_every_number_can_be_formed_and_none_that_can_is_left_out(bounds: Bounds, count: int) -> None:
    least = bounds.least
    largest = {"auto": count}.get(bounds.groups, bounds.groups) if not isinstance(bounds.groups, tuple) else None
    largest = bounds.groups[1] if largest is None else largest
    admitted = [m for m in range(least, min(largest, count) + 1) if m * bounds.min_group_size <= count]
    if admitted:
        assert list(bounds.numbers(count)) == admitted
    else:
        assert bounds.refusal(count) is not None


@given(bounds=all_bounds, count=st.integers(1, 30))
def test_loosened_bounds_are_satisfiable_and_the_nearest(bounds: Bounds, count: int) -> None:
    loosened = bounds.loosened(count)
    assert loosened.refusal(count) is None
    if bounds.refusal(count) is None:
        assert loosened == bounds
        return
    # The number counts more: it gives way only to the number of robots, and the size only as far as it must.
    assert loosened.least == min(bounds.least, count)
    if loosened.least == bounds.least:
        assert loosened.groups == bounds.groups
    assert loosened.min_group_size <= bounds.min_group_size
    if loosened.min_group_size < bounds.min_group_size:
        assert Bounds(loosened.groups, loosened.min_group_size + 1).refusal(count) is not None


def parted(seed: int, count: int) -> Labels:
    rng = np.random.default_rng(seed)
    return rng.integers(0, rng.integers(1, count + 1), count)


@given(seed=seeds, count=st.integers(1, 20), size=st.integers(1, 6), least=st.integers(1, 6))
@settings(deadline=None)
def test_groups_become_as_large_as_they_must_and_as_many(seed: int, count: int, size: int, least: int) -> None:
    assume(size * least <= count)
    labels = parted(seed, count)
    before = labels.copy()
    formed = len(set(labels.tolist()))
    sized = with_least_size(jumbled(seed, count), labels, size, least)
    sizes = np.bincount(sized)
    assert sizes.min() >= size
    assert min(least, formed) <= len(sizes) <= formed
    np.testing.assert_array_equal(labels, before)
    if np.unique(labels, return_counts=True)[1].min() >= size:
        np.testing.assert_array_equal(together(sized), together(labels))


def one_by_one(S: Floats, labels: Labels, size: int, least: int) -> Labels:
    """As the docstring says, from scratch at each step."""
    while True:
        labels = np.unique(labels, return_inverse=True)[1]
        sizes = np.bincount(labels)
        small = np.flatnonzero(sizes == sizes.min())
        if sizes.min() >= size:
            return labels
        member = labels == np.arange(len(sizes))[:, None]
        if len(sizes) > least:
            common = {
                (a, b): S[np.ix_(member[a], member[b])].mean() for a in small for b in range(len(sizes)) if b != a
            }
            a, b = max(common, key=common.__getitem__)
            labels = np.where(labels == a, b, labels)
        else:
            better = {}
            for i in np.flatnonzero(sizes[labels] > size).tolist():
                mates = member[labels[i]].copy()
                mates[i] = False
                better |= {(i, group): S[i, member[group]].mean() - S[i, mates].mean() for group in small}
            i, group = max(better, key=better.__getitem__)
            labels[i] = group


@given(seed=seeds, count=st.integers(1, 20), size=st.integers(1, 6), least=st.integers(1, 6))
@settings(deadline=None)
def test_the_smallest_groups_merge_or_grow_as_suits_best(seed: int, count: int, size: int, least: int) -> None:
    assume(size * least <= count)
    S, labels = jumbled(seed, count), parted(seed, count)
    expected = one_by_one(S, labels, size, least)
    np.testing.assert_array_equal(together(with_least_size(S, labels, size, least)), together(expected))


@given(seed=seeds, count=st.integers(1, 20), size=st.integers(1, 6), least=st.integers(1, 6))
@settings(deadline=None)
def test_neither_the_order_of_robots_nor_the_names_of_groups_matter(seed: int, count: int, size: int, least) -> None:
    assume(size * least <= count)
    S, labels, rng = jumbled(seed, count), parted(seed, count), np.random.default_rng(seed)
    sized = with_least_size(S, labels, size, least)
    order = rng.permutation(count)
    shuffled = with_least_size(reordered(S, order), rng.permutation(count)[labels][order], size, least)
    np.testing.assert_array_equal(reordered(together(sized), order), together(shuffled))


def test_the_smallest_group_joins_the_one_it_has_most_in_common_with_on_average() -> None:
    S = alike(7, 0.1)
    # 6 has more in common with one of the first three than with anybody else, but most with the pair.
    S[6, 0] = S[0, 6] = 0.9
    S[6, 3:6] = S[3:6, 6] = 0.5
    np.testing.assert_array_equal(
        together(with_least_size(S, np.array([0, 0, 0, 1, 1, 1, 2]), 2, 1)), together(np.array([0, 0, 0, 1, 1, 1, 1]))
    )


def test_where_groups_must_stay_the_smallest_takes_in_whom_it_suits_best() -> None:
    S, truth = planted(4, (4, 3, 1))
    loner, first, second = (np.flatnonzero(truth == group) for group in (2, 0, 1))
    S[loner, second[0]] = S[second[0], loner] = 0.99
    S[loner, first[1]] = S[first[1], loner] = 0.95
    # The group of three can spare nobody.
    sized = with_least_size(S, truth, 2, 3)
    assert sorted(np.bincount(sized).tolist()) == [2, 3, 3] or sorted(np.bincount(sized).tolist()) == [2, 2, 4]
    assert sized[loner[0]] == sized[second[0]]
    kept = with_least_size(S, truth, 2, 3) == sized[first[0]]
    np.testing.assert_array_equal(np.flatnonzero(kept), first)


@pytest.mark.parametrize("S", [np.ones((6, 6)), np.eye(6)], ids=["in one place", "apart"])
@pytest.mark.parametrize(("size", "least", "sizes"), [(2, 3, [2, 2, 2]), (3, 2, [3, 3]), (6, 1, [6])])
def test_robots_that_nothing_tells_apart_still_keep_the_bounds(S, size: int, least: int, sizes: list[int]) -> None:
    assert np.bincount(with_least_size(S, np.arange(6), size, least)).min() >= size
    assert np.bincount(with_least_size(S, np.array([0, 0, 0, 0, 1, 2])[: len(S)], size, least)).min() >= size
    assert len(np.bincount(with_least_size(S, np.arange(6), size, least))) == len(sizes)
