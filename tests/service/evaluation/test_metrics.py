from __future__ import annotations

import numpy as np
import pytest
from covista_service.evaluation.metrics import measure

NONE = np.full(4, np.nan)
TRUTH = np.array([0.1, 0.4, 0.6, 0.9])


def test_the_truth_is_perfect() -> None:
    found = measure(TRUTH, TRUTH, NONE, NONE, np.array([3.0, 1.0, 2.0]))
    assert (found.pairs, found.mae, found.mae_found, found.found_share) == (4, 0.0, 0.0, 1.0)
    assert found.rank_correlation == pytest.approx(1.0)
    assert found.interval_coverage is None
    assert found.ms_median == 2.0


def test_no_answer_counts_as_nothing_seen() -> None:
    answers = np.array([np.nan, 0.5, 0.6, np.nan])
    found = measure(TRUTH, answers, NONE, NONE, np.ones(2))
    assert found.mae == pytest.approx((0.1 + 0.1 + 0 + 0.9) / 4)
    assert found.mae_found == pytest.approx(0.05)
    assert found.found_share == 0.5
    as_zero = measure(TRUTH, np.nan_to_num(answers), NONE, NONE, np.ones(2))
    assert as_zero.mae == found.mae
    assert as_zero.rank_correlation == found.rank_correlation


def test_order_alone_decides_the_rank_correlation() -> None:
    assert measure(TRUTH, TRUTH**3, NONE, NONE, np.ones(1)).rank_correlation == pytest.approx(1.0)
    assert measure(TRUTH, 1 - TRUTH, NONE, NONE, np.ones(1)).rank_correlation == pytest.approx(-1.0)


def test_coverage_is_over_the_answers_with_an_interval() -> None:
    low, high = np.array([0.0, 0.5, np.nan, 0.8]), np.array([0.2, 0.6, np.nan, 0.9])
    found = measure(TRUTH, TRUTH, low, high, np.ones(1))
    assert found.interval_coverage == pytest.approx(2 / 3)
    assert found.interval_width == pytest.approx(0.4 / 3)


@pytest.mark.parametrize("truth", [np.zeros(0), np.array([1.0]), np.array([0.7, 0.7])])
def test_what_cannot_be_said_is_not_said(truth: np.ndarray) -> None:
    unanswered = np.full(len(truth), np.nan)
    found = measure(truth, unanswered, unanswered, unanswered, np.zeros(0))
    assert found.rank_correlation is None
    assert found.mae_found is None
    assert found.ms_median is None
    assert (found.mae is None) == (not len(truth))
