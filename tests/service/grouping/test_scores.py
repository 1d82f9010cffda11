"""Each measure of a grouping against its definition, robot by robot."""

import numpy as np
import pytest
from covista_service.grouping import scores
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.grouping.swarms import Floats, Labels, alike, jumbled, members, planted, reordered

STRANGER = 0.3
seeds, counts = st.integers(0, 10_000), st.integers(1, 14)


def parted(seed: int, count: int) -> tuple[Floats, Labels]:
    """A similarity matrix and a partition, both at random."""
    rng = np.random.default_rng(seed)
    return jumbled(seed, count), np.unique(rng.integers(0, rng.integers(1, count + 1), count), return_inverse=True)[1]


def groups_of(labels: Labels) -> list[list[int]]:
    return [np.flatnonzero(labels == label).tolist() for label in range(labels.max() + 1)]


def silhouette(S: Floats, labels: Labels, i: int) -> float:
    mates = [j for j in range(len(S)) if labels[j] == labels[i] and j != i]
    others = [np.mean([S[i, j] for j in group]) for group in groups_of(labels) if i not in group]
    if mates:
        a, b = np.mean([S[i, j] for j in mates]), max([STRANGER, *others])
    else:
        a, b = STRANGER, max([0.0, *others])
    return (a - b) / (1 - min(a, b)) / len(S)


def expectation(S: Floats, i: int, demand: float) -> float:
    best = sorted((S[i, j] for j in range(len(S)) if j != i), reverse=True)[:2]
    return max(STRANGER, demand * np.mean(best)) if best else STRANGER


def gain(S: Floats, labels: Labels, i: int) -> float:
    expected = [expectation(S, j, 0.7) for j in range(len(S))]
    mates = [j for j in range(len(S)) if labels[j] == labels[i] and j != i]
    return sum(S[i, j] - (expected[i] + expected[j]) / 2 for j in mates) / 2


def modularity(S: Floats, labels: Labels, i: int) -> float:
    degree = [sum(S[j, k] for k in range(len(S)) if k != j) for j in range(len(S))]
    total = sum(degree)
    if total == 0:
        return 0.0
    mates = [j for j in range(len(S)) if labels[j] == labels[i]]
    return sum((S[i, j] if j != i else 0.0) - degree[i] * degree[j] / total for j in mates) / total


def connectivity(S: Floats, labels: Labels, i: int) -> float:
    groups = groups_of(labels)
    group = next(group for group in groups if i in group)
    if len(group) == 1:
        return 0.0
    A = S[np.ix_(group, group)]
    laplacian = np.diag(A.sum(axis=1)) - A
    return np.linalg.eigvalsh(laplacian)[1] / len(group) / len(groups)


MEASURES = {
    "silhouette": (lambda S, labels: scores.silhouette(S, labels, STRANGER), silhouette),
    "gain": (lambda S, labels: scores.gain(S, labels, scores.expectations(S, STRANGER, 0.7)), gain),
    "modularity": (scores.modularity, modularity),
    "connectivity": (scores.connectivity, connectivity),
}
by_measure = pytest.mark.parametrize("measure", [of_all for of_all, _ in MEASURES.values()], ids=MEASURES)


@pytest.mark.parametrize(("measure", "of_one"), MEASURES.values(), ids=MEASURES)
@given(seed=seeds, count=counts)
@settings(max_examples=60, deadline=None)
def test_each_robot_contributes_what_the_definition_says(measure, of_one, seed: int, count: int) -> None:
    S, labels = parted(seed, count)
    expected = [of_one(S, labels, i) for i in range(count)]
    np.testing.assert_allclose(measure(S, labels), expected, rtol=0, atol=1e-12)


@by_measure
@given(seed=seeds, count=counts)
@settings(max_examples=60, deadline=None)
def test_labels_are_but_names(measure, seed: int, count: int) -> None:
    S, labels = parted(seed, count)
    renamed = np.random.default_rng(seed + 1).permutation(labels.max() + 1)[labels]
    np.testing.assert_allclose(measure(S, renamed), measure(S, labels), rtol=0, atol=1e-12)


@by_measure
@given(seed=seeds, count=counts)
@settings(max_examples=60, deadline=None)
def test_the_order_of_robots_does_not_matter(measure, seed: int, count: int) -> None:
    S, labels = parted(seed, count)
    order = np.random.default_rng(seed + 1).permutation(count)
    shuffled = measure(reordered(S, order), labels[order])
    np.testing.assert_allclose(shuffled, measure(S, labels)[order], rtol=0, atol=1e-12)


@by_measure
def test_nobody_contributes_nothing(measure) -> None:
    assert measure(np.zeros((0, 0)), np.zeros(0, np.intp)).shape == (0,)


@by_measure
def test_planted_groups_score_better_than_others(measure) -> None:
    S, truth = planted(2, (4, 4, 4))
    rng = np.random.default_rng(2)
    best = measure(S, truth).sum()
    for _ in range(30):
        other = rng.permutation(truth)
        assert measure(S, other).sum() < best or (members(other) @ members(truth).T == 4).any()


@pytest.mark.parametrize("count", [1, 2, 7])
@pytest.mark.parametrize("weight", [0.0, STRANGER, 0.6, 1.0])
def test_the_silhouette_of_one_group_and_of_all_alone_is_against_the_outsider(count: int, weight: float) -> None:
    S = alike(count, weight)
    as_one = scores.silhouette(S, np.zeros(count, np.intp), STRANGER).sum()
    alone = scores.silhouette(S, np.arange(count), STRANGER).sum()
    # Who stands alone has nobody else.
    between = weight if count > 1 else 0.0
    assert alone == pytest.approx((STRANGER - between) / (1 - min(STRANGER, between)))
    assert as_one == pytest.approx(alone if count == 1 else (weight - STRANGER) / (1 - min(weight, STRANGER)))


@given(seed=seeds, count=counts)
def test_silhouettes_lie_from_minus_1_to_1(seed: int, count: int) -> None:
    S, labels = parted(seed, count)
    assert (np.abs(scores.silhouette(S, labels, STRANGER)) <= 1 / count + 1e-12).all()


def test_the_silhouette_of_who_is_as_one_with_two_groups_is_nought() -> None:
    np.testing.assert_array_equal(scores.silhouette(np.ones((4, 4)), np.array([0, 0, 1, 1]), STRANGER), np.zeros(4))


@pytest.mark.parametrize(("alpha", "expected"), [(0.0, 0.5), (0.5, 0.3), (1.0, 0.1)])
def test_distance_makes_strangers_more_alike_than_overlap_does(alpha: float, expected: float) -> None:
    assert scores.outsider(alpha) == pytest.approx(expected)


@given(seed=seeds, count=counts, demand=st.floats(0, 1))
def test_expectations_are_a_share_of_the_best_and_no_less_than_the_outsider(seed, count: int, demand: float) -> None:
    S = jumbled(seed, count)
    expected = [expectation(S, i, demand) for i in range(count)]
    np.testing.assert_allclose(scores.expectations(S, STRANGER, demand), expected, rtol=0, atol=1e-14)


@given(seed=seeds, count=counts)
@settings(deadline=None)
def test_gain_is_the_sum_over_pairs_inside_groups(seed: int, count: int) -> None:
    S, labels = parted(seed, count)
    expected = scores.expectations(S, STRANGER, 0.7)
    pairs = [(i, j) for i in range(count) for j in range(i) if labels[i] == labels[j]]
    total = sum(S[i, j] - (expected[i] + expected[j]) / 2 for i, j in pairs)
    assert scores.gain(S, labels, expected).sum() == pytest.approx(total, abs=1e-12)


@given(seed=seeds, count=counts)
def test_modularity_of_one_group_is_nought(seed: int, count: int) -> None:
    assert scores.modularity(jumbled(seed, count), np.zeros(count, np.intp)).sum() == pytest.approx(0.0, abs=1e-12)


def test_robots_with_nothing_in_common_have_no_modularity() -> None:
    np.testing.assert_array_equal(scores.modularity(np.eye(3), np.array([0, 0, 1])), np.zeros(3))


@pytest.mark.parametrize(("count", "weight"), [(2, 0.3), (3, 0.5), (7, 0.2)])
def test_the_fiedler_value_of_equal_weights_is_their_sum_at_a_robot_and_one_more(count: int, weight: float) -> None:
    group = tuple(range(count))
    assert scores.fiedler_values(alike(count, weight), [group])[group] == pytest.approx(count * weight)


def test_a_robot_alone_counts_nothing() -> None:
    assert scores.fiedler_values(alike(3, 0.5), [(0,), (2,)]) == {(0,): 0.0, (2,): 0.0}


def test_a_path_has_the_fiedler_value_of_the_book() -> None:
    S = np.eye(3) + np.diag([1.0, 1.0], 1) + np.diag([1.0, 1.0], -1)
    assert scores.fiedler_values(S, [(0, 1, 2)])[0, 1, 2] == pytest.approx(1.0)


def test_a_group_in_two_parts_has_no_connectivity() -> None:
    S = np.kron(np.eye(2), np.ones((2, 2)))
    assert scores.fiedler_values(S, [(0, 1, 2, 3)])[0, 1, 2, 3] == pytest.approx(0.0, abs=1e-12)


def test_groups_of_many_sizes_are_solved_as_each_alone() -> None:
    S = jumbled(3, 9)
    groups = [(0, 1, 2), (1, 2, 5), (3, 4), (6,), (0, 2, 4, 6, 8), (3, 4)]
    told = scores.fiedler_values(S, groups)
    assert told.keys() == set(groups)
    for group in groups:
        assert told[group] == pytest.approx(scores.fiedler_values(S, [group])[group])


@given(labels=st.lists(st.integers(0, 4), max_size=12))
def test_members_are_the_rows_of_each_group(labels: list[int]) -> None:
    dense = np.unique(np.array(labels, np.intp), return_inverse=True)[1]
    groups = scores.members_of(dense)
    assert sorted(row for group in groups for row in group) == list(range(len(labels)))
    for label, group in enumerate(groups):
        assert group
        assert all(dense[row] == label for row in group)
