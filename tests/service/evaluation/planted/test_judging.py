from __future__ import annotations

import numpy as np
import pytest
from covista_service.evaluation.planted.judging import adjusted_rand
from sklearn.metrics import adjusted_rand_score


@pytest.mark.parametrize("seed", range(20))
def test_it_is_what_scikit_learn_computes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth, found = rng.integers(0, 5, 30), rng.integers(0, 4, 30)
    assert adjusted_rand(truth, found) == pytest.approx(adjusted_rand_score(truth, found), abs=1e-12)


def test_names_of_groups_do_not_matter_nor_which_is_the_truth() -> None:
    rng = np.random.default_rng(0)
    truth, found = rng.integers(0, 5, 30), rng.integers(0, 4, 30)
    assert adjusted_rand(truth, rng.permutation(5)[truth]) == 1.0
    assert adjusted_rand(truth, found) == pytest.approx(adjusted_rand(found, truth))


@pytest.mark.parametrize(
    ("truth", "found", "expected"),
    [
        ([0, 0, 0], [4, 4, 4], 1.0),
        ([0, 1, 2], [2, 1, 0], 1.0),
        ([0, 0, 0], [0, 1, 2], 0.0),
        ([0, 1, 2], [0, 0, 1], 0.0),
        ([0], [0], 1.0),
    ],
)
def test_all_in_one_and_all_apart(truth: list[int], found: list[int], expected: float) -> None:
    assert adjusted_rand(np.array(truth), np.array(found)) == expected


def test_chance_is_worth_nothing() -> None:
    rng = np.random.default_rng(1)
    values = [adjusted_rand(rng.integers(0, 6, 40), rng.integers(0, 6, 40)) for _ in range(300)]
    assert np.mean(values) == pytest.approx(0, abs=0.01)
