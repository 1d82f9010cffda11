"""How many groups, and why: every criterion, every bound, and what is no swarm at all."""

from typing import get_args

import numpy as np
import pytest
from covista_service.grouping import scores
from covista_service.grouping.bounds import with_least_size
from covista_service.grouping.k_means import canonical
from covista_service.grouping.selection import (
    FINE,
    GAIN,
    MERGE,
    ONE_BY_ONE_UP_TO,
    PAPER_UP_TO,
    Choice,
    Criterion,
    SelectionOptions,
    candidates,
    choose,
    contributions,
)
from covista_service.grouping.similarity import matrix
from covista_service.grouping.spectral import Spectrum, partition
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.grouping.swarms import (
    Labels,
    alike,
    distances,
    jumbled,
    planted,
    reordered,
    scattered,
    together,
)

CRITERIA: tuple[Criterion, ...] = get_args(Criterion)
by_criterion = pytest.mark.parametrize("criterion", CRITERIA)
# By these the groups of every number are scored, and the best are taken.
SCORING = tuple(criterion for criterion in CRITERIA if criterion != "eigengap")
seeds, counts = st.integers(0, 10_000), st.integers(1, 14)
kinds = st.sampled_from([scattered, jumbled, lambda seed, count: jumbled(seed, count, 0.5)])
groupings = st.just("auto") | st.integers(1, 6) | st.tuples(st.integers(1, 6), st.integers(6, 16))


def formed(choice: Choice) -> int:
    return int(choice.labels.max()) + 1


def numbers(choice: Choice) -> list[int]:
    return [m for m, _ in choice.scores]


@by_criterion
@pytest.mark.parametrize("sizes", [(3, 3), (4, 3, 3), (2, 5, 3, 3), (5, 5, 5)])
def test_planted_groups_are_found_with_their_number(criterion: Criterion, sizes: tuple[int, ...]) -> None:
    S, truth = planted(11, sizes)
    choice = choose(S, SelectionOptions(criterion=criterion))
    np.testing.assert_array_equal(together(choice.labels), together(truth))


# Eq. 17 is not meant for swarms, eigengap and modularity see no groups of one.
@pytest.mark.parametrize("criterion", ["adaptive", "silhouette", "gain"])
@pytest.mark.parametrize("sizes", [(1, 3, 3), (5, 2, 1, 1), (30, 1, 12), (20,) * 4, (4,) * 20, (150, 100, 60, 9)])
def test_loners_and_crowds_are_told_apart(criterion: Criterion, sizes: tuple[int, ...]) -> None:
    S, truth = planted(12, sizes)
    choice = choose(S, SelectionOptions(criterion=criterion))
    np.testing.assert_array_equal(together(choice.labels), together(truth))


@by_criterion
@given(seed=seeds, count=counts, kind=kinds, groups=groupings, size=st.integers(1, 3))
@settings(max_examples=60, deadline=None)
def test_bounds_are_honoured_or_refused(criterion: Criterion, seed: int, count: int, kind, groups, size: int) -> None:
    options = SelectionOptions(groups, criterion, size)
    if options.bounds.refusal(count) is not None:
        with pytest.raises(ValueError, match="cannot form"):
            choose(kind(seed, count), options)
        return
    choice = choose(kind(seed, count), options)
    assert np.bincount(choice.labels).min() >= size
    assert formed(choice) in candidates(count, options)
    assert set(numbers(choice)) <= set(candidates(count, options))
    assert numbers(choice) == sorted(set(numbers(choice)))
    np.testing.assert_array_equal(choice.labels, canonical(choice.labels, count))


@pytest.mark.parametrize("criterion", SCORING)
@given(seed=seeds, count=counts, kind=kinds, groups=groupings, size=st.integers(1, 3))
@settings(max_examples=60, deadline=None)
def test_the_choice_has_the_best_score_of_all_told_and_it_is_its_own(criterion, seed, count, kind, groups, size: int):
    S, options = kind(seed, count), SelectionOptions(groups, criterion, size)
    if options.bounds.refusal(count) is not None:
        return
    choice = choose(S, options)
    told = dict(choice.scores)
    own = contributions(S, options)(choice.labels).sum()
    assert told[formed(choice)] == pytest.approx(own, abs=1e-9)
    assert own >= max(told.values()) - 2e-9 * max(1.0, abs(own))
    assert all(score < own - 1e-9 for m, score in told.items() if m < formed(choice))


@given(seed=seeds, count=counts, kind=kinds, groups=groupings)
@settings(deadline=None)
def test_eigengap_takes_the_number_after_which_eigenvalues_fall_most(seed: int, count: int, kind, groups) -> None:
    S, options = kind(seed, count), SelectionOptions(groups, "eigengap")
    if options.bounds.refusal(count) is not None:
        return
    choice = choose(S, options)
    scale = 1 / np.sqrt(S.sum(axis=1))
    values = [*np.clip(np.linalg.eigvalsh(scale[:, None] * S * scale), 0, None)[::-1], 0.0]
    for m, gap in choice.scores:
        assert gap == pytest.approx(values[m - 1] - values[m], abs=1e-12)
    assert dict(choice.scores)[formed(choice)] == pytest.approx(max(gap for _, gap in choice.scores), abs=1e-8)


@by_criterion
@given(seed=seeds, count=st.integers(1, 20), kind=kinds, size=st.integers(1, 2))
@settings(max_examples=60, deadline=None)
def test_the_order_of_robots_does_not_matter(criterion: Criterion, seed: int, count: int, kind, size: int) -> None:
    S, options = kind(seed, count), SelectionOptions("auto", criterion, min(size, count))
    order = np.random.default_rng(seed).permutation(count)
    choice, shuffled = choose(S, options), choose(reordered(S, order), options)
    np.testing.assert_array_equal(reordered(together(choice.labels), order), together(shuffled.labels))
    np.testing.assert_allclose(choice.scores, shuffled.scores, rtol=0, atol=1e-9)


@by_criterion
def test_the_order_of_a_large_swarm_does_not_matter(criterion: Criterion) -> None:
    S, order = jumbled(1, 60), np.random.default_rng(1).permutation(60)
    choice, shuffled = (choose(some, SelectionOptions(criterion=criterion)) for some in (S, reordered(S, order)))
    np.testing.assert_array_equal(reordered(together(choice.labels), order), together(shuffled.labels))


@pytest.mark.parametrize(
    ("groups", "criterion", "looked_at"),
    [
        ("auto", "fiedler", range(1, 8)),
        ("auto", "paper", range(2, 8)),
        ("auto", "adaptive", range(1, 8)),
        ("auto", "silhouette", range(1, 8)),
        ("auto", "modularity", range(1, 8)),
        ("auto", "eigengap", range(1, 8)),
        (3, "fiedler", range(3, 4)),
        (3, "gain", range(3, 4)),
        (1, "paper", range(1, 2)),
        ((2, 4), "fiedler", range(2, 5)),
        ((2, 4), "adaptive", range(2, 5)),
        ((3, 99), "fiedler", range(3, 8)),
        ((7, 99), "fiedler", range(7, 8)),
        ((1, 3), "paper", range(2, 4)),
        ((1, 1), "paper", range(1, 2)),
    ],
)
def test_the_score_of_every_number_looked_at_is_told(groups, criterion: Criterion, looked_at: range) -> None:
    options = SelectionOptions(groups, criterion)
    assert candidates(7, options) == looked_at
    assert numbers(choose(scattered(3, 7), options)) == list(looked_at)


@pytest.mark.parametrize("count", [2, 47, 150, ONE_BY_ONE_UP_TO])
def test_adaptive_tells_of_every_number(count: int) -> None:
    choice = choose(scattered(4, count), SelectionOptions())
    assert numbers(choice) == list(range(1, count + 1))


def test_in_a_larger_swarm_adaptive_tells_of_every_number_down_from_fine_groups() -> None:
    S, truth = planted(4, (4,) * 76)
    choice = choose(S, SelectionOptions())
    np.testing.assert_array_equal(together(choice.labels), together(truth))
    assert numbers(choice) == list(range(1, numbers(choice)[-1] + 1))
    assert 76 <= numbers(choice)[-1] < len(S)


@pytest.mark.parametrize("criterion", ["adaptive", "gain"])
@pytest.mark.parametrize(("least", "size"), [(90, 1), (80, 2)])
def test_more_groups_than_moves_find_are_parted(criterion: Criterion, least: int, size: int) -> None:
    S, truth = planted(4, (5,) * 64)
    choice = choose(S, SelectionOptions((least, 100), criterion, size))
    assert formed(choice) >= least
    assert np.bincount(choice.labels).min() >= size
    # Parted, not mixed.
    assert len({(label, group) for label, group in zip(choice.labels.tolist(), truth.tolist(), strict=True)}) < 110


@pytest.mark.parametrize("criterion", ["silhouette", "modularity"])
def test_in_a_large_swarm_numbers_are_looked_at_more_closely_about_the_best(criterion: Criterion) -> None:
    S, truth = planted(8, (7,) * 17)
    choice = choose(S, SelectionOptions(criterion=criterion))
    np.testing.assert_array_equal(together(choice.labels), together(truth))
    assert {16, 17, 18} <= set(numbers(choice))
    assert len(choice.scores) < 40


@by_criterion
def test_as_many_groups_as_robots_and_one(criterion: Criterion) -> None:
    S = scattered(2, 6)
    np.testing.assert_array_equal(choose(S, SelectionOptions(6, criterion)).labels, np.arange(6))
    np.testing.assert_array_equal(choose(S, SelectionOptions(1, criterion)).labels, np.zeros(6))
    np.testing.assert_array_equal(choose(S, SelectionOptions("auto", criterion, 6)).labels, np.zeros(6))


@by_criterion
def test_nobody_has_no_groups(criterion: Criterion) -> None:
    choice = choose(np.zeros((0, 0)), SelectionOptions(criterion=criterion))
    assert choice.labels.shape == (0,)
    assert choice.scores == ()


@by_criterion
def test_one_robot_is_one_group(criterion: Criterion) -> None:
    choice = choose(np.ones((1, 1)), SelectionOptions(criterion=criterion))
    np.testing.assert_array_equal(choice.labels, [0])
    assert numbers(choice) == [1]


@by_criterion
@pytest.mark.parametrize("count", [2, 7, 60])
def test_robots_in_one_place_are_one_group_unless_two_are_the_least(criterion: Criterion, count: int) -> None:
    choice = choose(np.ones((count, count)), SelectionOptions(criterion=criterion))
    assert formed(choice) == (2 if criterion == "paper" else 1)
    assert np.isfinite([score for _, score in choice.scores]).all()


@pytest.mark.parametrize(
    ("criterion", "expected"),
    [("adaptive", 5), ("silhouette", 5), ("gain", 5), ("eigengap", 5), ("fiedler", 1), ("paper", 2), ("modularity", 1)],
)
def test_robots_with_nothing_in_common_stand_alone_or_the_scores_are_a_tie(criterion: Criterion, expected: int) -> None:
    choice = choose(np.eye(5), SelectionOptions(criterion=criterion))
    assert formed(choice) == expected
    if criterion in ("fiedler", "paper", "modularity"):
        assert {score for _, score in choice.scores} == {0.0}


@pytest.mark.parametrize("criterion", SCORING)
def test_a_tie_goes_to_the_smaller_number_and_moves_nobody(criterion: Criterion) -> None:
    # As much in common as strangers have: together and alone are worth the same.
    S, options = alike(4, 0.3), SelectionOptions(criterion=criterion, stranger=0.3)
    choice = choose(S, options)
    if criterion == "gain":
        assert formed(choice) == 4
        assert formed(choose(S, options, np.array([0, 0, 1, 1]))) == 2
        return
    told = dict(choice.scores)
    best = max(told.values())
    assert formed(choice) == min(m for m, score in told.items() if score > best - 1e-9)


@pytest.mark.parametrize("criterion", ["adaptive", "silhouette"])
@pytest.mark.parametrize("weight", [0.1, 0.3, 0.7])
@pytest.mark.parametrize("count", [3, 6, 7, 11])
def test_scores_that_differ_by_rounding_are_a_tie(criterion: Criterion, weight: float, count: int) -> None:
    assert formed(choose(alike(count, weight), SelectionOptions(criterion=criterion, stranger=weight))) == 1


@given(seed=seeds, count=st.integers(2, 14), kind=kinds, criterion=st.sampled_from(["silhouette", "fiedler"]))
@settings(deadline=None)
def test_of_groups_that_become_as_many_by_their_size_the_best_count(seed: int, count: int, kind, criterion) -> None:
    S, options = kind(seed, count), SelectionOptions(criterion=criterion, min_group_size=2)
    best: dict[int, float] = {}
    for m in candidates(count, options):
        labels = with_least_size(S, partition(Spectrum.of(S), m), 2, 1)
        sized, score = int(labels.max()) + 1, float(contributions(S, options)(labels).sum())
        best[sized] = max(score, best.get(sized, -np.inf))
    told = dict(choose(S, options).scores)
    assert told.keys() == best.keys()
    np.testing.assert_allclose([told[m] for m in best], list(best.values()), rtol=0, atol=1e-12)


@by_criterion
@pytest.mark.parametrize(("groups", "size"), [("auto", 2), ((2, 3), 3), (3, 2), ((3, 5), 1)])
def test_robots_that_nothing_tells_apart_keep_the_bounds(criterion: Criterion, groups, size: int) -> None:
    for S in (np.ones((9, 9)), np.eye(9), alike(9, 0.5)):
        options = SelectionOptions(groups, criterion, size)
        choice = choose(S, options)
        assert formed(choice) in candidates(9, options)
        assert np.bincount(choice.labels).min() >= size


@by_criterion
def test_the_matrix_is_left_as_it_was_and_gives_the_same_again(criterion: Criterion) -> None:
    S = scattered(9, 20)
    kept = S.copy()
    first, second = (choose(S, SelectionOptions(criterion=criterion)) for _ in range(2))
    np.testing.assert_array_equal(S, kept)
    np.testing.assert_array_equal(first.labels, second.labels)
    assert first.scores == second.scores


def test_as_printed_there_are_two_groups_at_least_however_large_they_must_be() -> None:
    S, _ = planted(3, (3, 1))
    choice = choose(S, SelectionOptions(criterion="paper", min_group_size=2))
    assert np.bincount(choice.labels).tolist() == [2, 2]


def test_two_robots_with_anything_in_common_are_together() -> None:
    assert choose(alike(2, 0.01), SelectionOptions(criterion="fiedler")).labels.tolist() == [0, 0]
    assert choose(alike(2, 0.01), SelectionOptions(criterion="paper")).labels.tolist() == [0, 1]


@pytest.mark.parametrize("criterion", ["adaptive", "silhouette", "gain"])
@pytest.mark.parametrize("stranger", [0.1, 0.3, 0.5])
def test_two_robots_are_together_if_they_have_more_in_common_than_strangers(criterion, stranger: float) -> None:
    options = SelectionOptions(criterion=criterion, stranger=stranger)
    assert formed(choose(alike(2, stranger + 0.01), options)) == 1
    assert formed(choose(alike(2, stranger - 0.01), options)) == 2


@given(seed=seeds, count=counts, kind=kinds)
@settings(deadline=None)
def test_scores_are_those_of_the_measure(seed: int, count: int, kind) -> None:
    S, labels = kind(seed, count), np.unique(np.random.default_rng(seed).integers(0, 3, count), return_inverse=True)[1]
    expected = {
        "adaptive": scores.silhouette(S, labels, 0.3),
        "silhouette": scores.silhouette(S, labels, 0.3),
        "eigengap": scores.silhouette(S, labels, 0.3),
        "gain": scores.gain(S, labels, scores.expectations(S, 0.3, GAIN)),
        "fiedler": scores.connectivity(S, labels),
        "paper": scores.connectivity(S, labels),
        "modularity": scores.modularity(S, labels),
    }
    for criterion in CRITERIA:
        score_of = contributions(S, SelectionOptions(criterion=criterion, stranger=0.3))
        np.testing.assert_array_equal(score_of(labels), expected[criterion])


@given(seed=seeds, count=counts, kind=kinds)
@settings(deadline=None)
def test_gain_goes_on_from_the_groups_on_show(seed: int, count: int, kind) -> None:
    S, options = kind(seed, count), SelectionOptions(criterion="gain")
    settled = choose(S, options)
    np.testing.assert_array_equal(choose(S, options, settled.labels).labels, settled.labels)
    start = np.random.default_rng(seed).integers(0, count, count)
    begun = scores.gain(S, start, scores.expectations(S, options.stranger, GAIN)).sum()
    assert dict(choose(S, options, start).scores)[formed(choose(S, options, start))] >= begun - 1e-9


def test_fine_groups_are_finer_than_those_that_gain_finds() -> None:
    assert GAIN <= MERGE < FINE < 1
    assert PAPER_UP_TO < ONE_BY_ONE_UP_TO


# Fig. 8: cameras look down from 10 m; the footprint of each is a square.
FOOTPRINT_M = 2 * 10 * 0.464
RED = [(-0.4, -2.2), (2.1, 2.2)]
BLUE = [(40.1, 1.8), (36.8, 2.0), (40.3, -1.5)]
GREEN = [(30.8, 16.4), (32.7, 14.5), (28.7, 17.3)]


def fig_8(mover_x_m: float) -> Labels:
    position_m = np.array([(mover_x_m, -0.4), *RED, *BLUE, *GREEN])
    apart_m = np.abs(position_m[:, None] - position_m)
    overlap = np.clip(1 - apart_m / FOOTPRINT_M, 0, None).prod(axis=2)
    S = matrix(distances(position_m), overlap, 0.5, "std")
    return choose(S, SelectionOptions(criterion="fiedler")).labels


@pytest.mark.parametrize(
    ("mover_x_m", "expected"),
    [
        (0.8, [0, 0, 0, 1, 1, 1, 2, 2, 2]),
        (7.3, [0, 0, 0, 1, 1, 1, 2, 2, 2]),
        (13.9, [0, 0, 0, 1, 1, 1, 2, 2, 2]),
        (20.4, [0, 1, 1, 2, 2, 2, 3, 3, 3]),
        (26.9, [0, 1, 1, 0, 0, 0, 2, 2, 2]),
        (33.4, [0, 1, 1, 0, 0, 0, 2, 2, 2]),
    ],
)
def test_the_mover_of_fig_8_leaves_red_stands_alone_and_joins_blue(mover_x_m: float, expected: list[int]) -> None:
    assert fig_8(mover_x_m).tolist() == expected
