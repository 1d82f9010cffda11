"""What is no similarity matrix, and bounds that cannot be, are refused in words, whatever the criterion."""

from typing import get_args

import numpy as np
import pytest
from covista_service.grouping.selection import Criterion, SelectionOptions, choose

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
