"""Eq. 17: how many groups, and why."""

import numpy as np
import pytest
from covista_service.grouping.selection import Groups, SelectionOptions, choose, fiedler_values, members_of
from covista_service.grouping.similarity import Floats, closeness, similarity
from numpy.typing import NDArray
from scipy.spatial.distance import pdist, squareform

from tests.service.grouping.swarms import planted, scattered, together


def alike(count: int, weight: float) -> Floats:
    S = np.full((count, count), weight)
    np.fill_diagonal(S, 1.0)
    return S


@pytest.mark.parametrize(("count", "weight"), [(2, 0.3), (3, 0.5), (7, 0.2)])
def test_the_fiedler_value_of_equal_weights_is_their_sum_at_a_robot_and_one_more(count: int, weight: float) -> None:
    group = tuple(range(count))
    assert fiedler_values(alike(count, weight), [group])[group] == pytest.approx(count * weight)


def test_a_robot_alone_counts_nothing() -> None:
    assert fiedler_values(alike(3, 0.5), [(0,), (2,)]) == {(0,): 0.0, (2,): 0.0}


def test_a_path_has_the_fiedler_value_of_the_book() -> None:
    S = np.eye(3) + np.diag([1.0, 1.0], 1) + np.diag([1.0, 1.0], -1)
    assert fiedler_values(S, [(0, 1, 2)])[0, 1, 2] == pytest.approx(1.0)


def test_a_uniform_swarm_is_one_group_unless_two_are_the_least_as_printed() -> None:
    assert choose(alike(6, 0.5), SelectionOptions()).labels.max() == 0
    assert choose(alike(6, 0.5), SelectionOptions(criterion="paper")).labels.max() == 1


def test_two_robots_with_anything_in_common_are_together() -> None:
    assert choose(alike(2, 0.01), SelectionOptions()).labels.tolist() == [0, 0]
    assert choose(alike(2, 0.01), SelectionOptions(criterion="paper")).labels.tolist() == [0, 1]


@pytest.mark.parametrize("sizes", [(3, 3), (4, 3, 3), (2, 5, 3, 3)])
def test_planted_groups_are_found_with_their_number(sizes: tuple[int, ...]) -> None:
    S, truth = planted(11, sizes)
    np.testing.assert_array_equal(together(choose(S, SelectionOptions()).labels), together(truth))


@pytest.mark.parametrize(
    ("groups", "criterion", "looked_at"),
    [
        ("auto", "fiedler", range(1, 8)),
        ("auto", "paper", range(2, 8)),
        (3, "fiedler", range(3, 4)),
        (1, "paper", range(1, 2)),
        ((2, 4), "fiedler", range(2, 5)),
        ((3, 99), "fiedler", range(3, 8)),
        ((20, 99), "fiedler", range(7, 8)),
        ((1, 3), "paper", range(2, 4)),
        ((1, 1), "paper", range(1, 2)),
    ],
)
def test_the_score_of_every_number_looked_at_is_told(groups: Groups, criterion, looked_at: range) -> None:
    choice = choose(scattered(3, 7), SelectionOptions(groups, criterion))
    assert [m for m, _ in choice.scores] == list(looked_at)
    chosen = int(choice.labels.max()) + 1
    assert dict(choice.scores)[chosen] == pytest.approx(max(score for _, score in choice.scores))


def test_scores_are_mean_fiedler_values() -> None:
    S = scattered(4, 7)
    labels = choose(S, SelectionOptions(3)).labels
    values = fiedler_values(S, members_of(labels, 3))
    assert choose(S, SelectionOptions(3)).scores == ((3, pytest.approx(sum(values.values()) / 3)),)


def test_a_tie_goes_to_the_smaller_number() -> None:
    choice = choose(np.eye(4), SelectionOptions())
    assert {score for _, score in choice.scores} == {0.0}
    assert choice.labels.max() == 0


@pytest.mark.parametrize("groups", [0, 5, -1])
def test_a_fixed_number_that_cannot_be_is_refused(groups: int) -> None:
    with pytest.raises(ValueError, match=f"4 robots cannot form {groups} groups"):
        choose(alike(4, 0.5), SelectionOptions(groups))


@pytest.mark.parametrize("groups", [(0, 3), (3, 2)])
def test_bounds_that_make_no_sense_are_refused(groups: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match="1 <= least <= largest"):
        choose(alike(4, 0.5), SelectionOptions(groups))


def test_nobody_has_no_groups() -> None:
    choice = choose(np.zeros((0, 0)), SelectionOptions())
    assert len(choice.labels) == 0
    assert choice.scores == ()


def test_one_robot_is_one_group() -> None:
    for criterion in ("fiedler", "paper"):
        assert choose(np.ones((1, 1)), SelectionOptions(criterion=criterion)).scores == ((1, 0.0),)


# Fig. 8: cameras look down from 10 m; the footprint of each is a square.
FOOTPRINT_M = 2 * 10 * 0.464
RED = [(-0.4, -2.2), (2.1, 2.2)]
BLUE = [(40.1, 1.8), (36.8, 2.0), (40.3, -1.5)]
GREEN = [(30.8, 16.4), (32.7, 14.5), (28.7, 17.3)]


def fig_8(mover_x_m: float) -> NDArray[np.intp]:
    position_m = np.array([(mover_x_m, -0.4), *RED, *BLUE, *GREEN])
    apart_m = np.abs(position_m[:, None] - position_m)
    overlap = np.clip(1 - apart_m / FOOTPRINT_M, 0, None).prod(axis=2)
    S = similarity(overlap, closeness(squareform(pdist(position_m)), "std"), 0.5)
    return choose(S, SelectionOptions()).labels


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
