"""How good answers are against the truth, over all ordered pairs whose truth is defined."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from covista_service.perception.camera import Floats


@dataclass(frozen=True, slots=True)
class Metrics:
    """Figures of one method on one set; None where there is nothing to compute them from.

    An overlap without an answer counts as 0 in `mae` and `rank_correlation` (Spearman), and is left out of
    `mae_found`; `found_share` is the share that has an answer. `interval_coverage` is the share of intervals that hold
    the truth, `interval_width` their mean width.
    """

    pairs: int
    mae: float | None
    mae_found: float | None
    rank_correlation: float | None
    found_share: float | None
    interval_coverage: float | None
    interval_width: float | None
    ms_median: float | None


def measure(truth: Floats, answers: Floats, low: Floats, high: Floats, ms: Floats) -> Metrics:
    """Metrics of `answers` (n,) to ordered pairs with `truth` (n,), NaN where there is no answer.

    `low`, `high` (n,) are the answers' intervals, NaN where there are none; `ms` (m,) the time of each unordered pair.
    """
    found = np.isfinite(answers)
    given = np.where(found, answers, 0.0)
    error = np.abs(given - truth)
    bounded = np.isfinite(low) & np.isfinite(high)
    inside = (truth >= low) & (truth <= high)
    return Metrics(
        pairs=len(truth),
        mae=_mean(error),
        mae_found=_mean(error[found]),
        rank_correlation=_rank_correlation(truth, given),
        found_share=_mean(found),
        interval_coverage=_mean(inside[bounded]),
        interval_width=_mean((high - low)[bounded]),
        ms_median=float(np.median(ms)) if len(ms) else None,
    )


def _mean(values: Floats | NDArray[np.bool_]) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _rank_correlation(truth: Floats, given: Floats) -> float | None:
    """Spearman's; None where one side does not vary, since there is no order to agree with then."""
    if len(truth) < 2 or np.ptp(truth) == 0 or np.ptp(given) == 0:
        return None
    return float(stats.spearmanr(truth, given).statistic)
