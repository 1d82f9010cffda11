"""What is no similarity matrix, and bounds that cannot be, are refused in words, whatever the criterion."""

from typing import get_args

import numpy as np
import pytest
from covista_service.grouping.affinity import Affinity
from covista_service.grouping.selection import Criterion, SelectionOptions, choose
from covista_service.grouping.similarity import matrix

from tests.service.grouping.swarms import Floats, alike, scattered

by_criterion = pytest.mark.parametrize("criterion", get_args(Criterion))


def spoilt(value: float, *places: tuple[int, int]) -> Floats:
    S = scattered(1, 4)
    for place in places:
        S[place] = value
    return S


UNSOUND = {
    "NaN": (spoilt(np.nan, (1, 2), (2, 1)), "similarities are finite, that of rows 1 and 2 is nan"),
    "NaN on the diagonal": (spoilt(np.nan, (3, 3)), "similarities are finite, that of rows 3 and 3 is nan"),
    "infinite": (spoilt(-np.inf, (0, 2), (2, 0)), "similarities are finite, that of rows 0 and 2 is -inf"),
    "infinities that cancel": (spoilt(np.inf, (0, 1)) + spoilt(-np.inf, (1, 0)), "that of rows 0 and 1 is inf"),
    "not symmetric": (spoilt(0.123, (0, 1)), "symmetric, lies from 0 to 1, and is 1 on its diagonal"),
    "below 0": (spoilt(-0.01, (0, 1), (1, 0)), "lies from 0 to 1"),
    "above 1": (spoilt(1.01, (0, 1), (1, 0)), "lies from 0 to 1"),
    "beyond all sums": (np.full((4, 4), 1e308), "lies from 0 to 1"),
    "diagonal": (spoilt(0.99, (2, 2)), "is 1 on its diagonal"),
    "not square": (np.ones((2, 3)), r"a similarity matrix is square, not \(2, 3\)"),
    "a row": (np.ones(3), r"square, not \(3,\)"),
}


@by_criterion
@pytest.mark.parametrize(("S", "sentence"), UNSOUND.values(), ids=UNSOUND)
def test_what_is_no_similarity_matrix_is_refused_and_says_why(criterion: Criterion, S: Floats, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        choose(S, SelectionOptions(criterion=criterion))


@by_criterion
@pytest.mark.parametrize(
    ("groups", "size", "sentence"),
    [
        (5, 1, "4 robots cannot form 5 groups"),
        (0, 1, "4 robots cannot form 0 groups"),
        ((3, 2), 1, "1 <= least <= largest, not 3 and 2"),
        (2, 3, "4 robots cannot form 2 groups of at least 3"),
        ("auto", 0, "a group has at least one robot, not 0"),
    ],
)
def test_bounds_that_cannot_be_are_refused(criterion: Criterion, groups, size: int, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        choose(alike(4, 0.5), SelectionOptions(groups, criterion, size))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"groups": 2.0}, r"auto, a number, or \(least, largest\), not 2.0"),
        ({"groups": None}, "not None"),
        ({"groups": "many"}, "not 'many'"),
        ({"groups": (1, 2, 3)}, r"not \(1, 2, 3\)"),
        ({"min_group_size": 1.5}, "a number of robots, not 1.5"),
        ({"criterion": "best"}, "criteria are adaptive, silhouette, .* not 'best'"),
        ({"stranger": 5.0}, "lies from 0 to 1, not 5.0"),
        ({"stranger": np.nan}, "lies from 0 to 1, not nan"),
    ],
)
def test_what_is_no_option_is_refused(options, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        SelectionOptions(**options)


@pytest.mark.parametrize("start", [np.zeros(2, int), np.zeros(4), np.zeros((4, 4), int)])
def test_labels_to_start_with_are_as_many_numbers_as_robots(start) -> None:
    with pytest.raises(ValueError, match="4 robots start with as many whole numbers"):
        choose(scattered(1, 4), SelectionOptions(criterion="gain"), start)


def test_any_numbers_will_do_for_labels_to_start_with() -> None:
    S = scattered(1, 6)
    odd, even = np.array([7, 7, -3, -3, 99, 99]), np.array([0, 0, 1, 1, 2, 2])
    one, other = (choose(S, SelectionOptions(criterion="gain"), start).labels for start in (odd, even))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("kind", [np.float32, "F"])
def test_how_a_matrix_lies_in_memory_does_not_matter(kind) -> None:
    S = alike(5, 0.5)
    other = np.asfortranarray(S) if kind == "F" else S.astype(kind)
    np.testing.assert_array_equal(choose(other, SelectionOptions()).labels, choose(S, SelectionOptions()).labels)


TWO = np.array([(0.0, 1.0), (1.0, 0.0)])


@pytest.mark.parametrize(
    ("distance_m", "overlap", "alpha", "sigma", "sentence"),
    [
        (TWO, TWO, 1.5, "shared", "alpha lies from 0 to 1, not 1.5"),
        (TWO, TWO, np.nan, "std", "alpha lies from 0 to 1, not nan"),
        (TWO, TWO, 0.5, 0.0, "sigma is shared, std, or metres above 0, not 0.0"),
        (TWO, TWO, 0.5, -1.0, "not -1.0"),
        (TWO, TWO, 0.5, np.nan, "not nan"),
        (TWO, TWO, 0.5, "wide", "not 'wide'"),
        (TWO * np.nan, TWO, 0.5, 1.0, "distances are finite and not below 0"),
        (-TWO, TWO, 0.5, 1.0, "distances are finite and not below 0"),
        (TWO, 2 * TWO, 0.5, 1.0, "an overlap lies from 0 to 1, or is NaN"),
        (TWO, TWO[:1], 0.5, 1.0, "square and of one size"),
        (np.zeros((2, 3)), np.zeros((2, 3)), 0.5, 1.0, "square and of one size"),
    ],
)
def test_what_no_similarity_can_be_made_from_is_refused(distance_m, overlap, alpha, sigma, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        matrix(distance_m, overlap, alpha, sigma)


@pytest.mark.parametrize("smoothing", [0.0, -1.0, 1.5, np.nan])
def test_a_weight_that_is_none_is_refused(smoothing: float) -> None:
    with pytest.raises(ValueError, match="more than 0 and at most 1"):
        Affinity(smoothing)
    with pytest.raises(ValueError, match="more than 0 and at most 1"):
        Affinity().smoothing = smoothing


def test_an_affinity_refuses_what_is_no_range() -> None:
    with pytest.raises(ValueError, match="metres above 0, not -1"):
        Affinity().similarity(0.5, -1)
    with pytest.raises(ValueError, match="alpha lies from 0 to 1"):
        Affinity().similarity(2.0)
