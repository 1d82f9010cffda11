from __future__ import annotations

import numpy as np
import pytest
from covista_service.bench.trend import Trend, trend_of


def looks(mb_per_h: float, noise_mb: float, seed: int = 0) -> list[tuple[float, float]]:
    rng = np.random.default_rng(seed)
    return [(t, 300 + mb_per_h * t / 3600 + noise_mb * rng.normal()) for t in np.arange(0, 600, 0.5).tolist()]


@pytest.mark.parametrize("mb_per_h", [-40.0, 0.0, 3.0, 200.0])
def test_a_trend_is_found(mb_per_h: float) -> None:
    trend = trend_of(looks(mb_per_h, 0.1))
    assert trend.slope == pytest.approx(mb_per_h, abs=2)
    assert trend.margin < 2


def test_the_interval_holds_the_truth_as_often_as_it_says() -> None:
    trends = [trend_of(looks(50.0, 1.0, seed)) for seed in range(200)]
    held = sum(abs(trend.slope - 50) <= trend.margin for trend in trends)
    assert 180 <= held <= 198


def test_growth_while_a_station_starts_is_not_looked_at() -> None:
    settled = [(t, mb if t > 100 else mb - 100 + t) for t, mb in looks(0.0, 0.01)]
    assert abs(trend_of(settled).slope) < 1


def test_growth_is_told_as_a_share_of_what_was_there() -> None:
    # 300 MB, and 150 more in an hour: over 8 minutes 20.
    trend = trend_of(looks(150.0, 0.0))
    assert trend.grown / trend.level == pytest.approx(20 / 305, rel=0.01)


@pytest.mark.parametrize(
    ("slope", "margin", "verdict"),
    [
        (0, 0, "flat"),
        (0.5, 0.4, "flat"),
        (-50, 1, "flat"),
        (5, 1, "grows"),
        (0.5, 0.6, "cannot say"),
        (0, 100, "cannot say"),
        (0, float("inf"), "cannot say"),
    ],
)
def test_flat_is_what_has_for_sure_grown_by_no_more_than_may_be(slope: float, margin: float, verdict: str) -> None:
    assert Trend(slope, margin, hours=1.0, level=100.0).verdict(1.0) == verdict
    assert Trend(2 * slope, 2 * margin, hours=0.5, level=100.0).verdict(1.0) == verdict


def test_a_few_looks_are_enough() -> None:
    assert trend_of([(t, 100.0) for t in range(4)]).slope == 0


def beside(seed: int) -> list[float]:
    """Robots that come and go."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.integers(5, 12, 120), 10).astype(float).tolist()


@pytest.mark.parametrize("mb_per_h", [0.0, 40.0])
def test_what_comes_and_goes_with_robots_is_no_growth(mb_per_h: float) -> None:
    robots = beside(0)
    values = [(t, mb + 5 * n) for (t, mb), n in zip(looks(mb_per_h, 0.1), robots, strict=True)]
    trend = trend_of(values, robots)
    assert trend.slope == pytest.approx(mb_per_h, abs=3)
    assert trend.margin < 3 < trend_of(values).margin


def test_of_what_grows_as_that_does_which_may_explain_it_nothing_is_said() -> None:
    values = looks(40.0, 0.0)
    trend = trend_of(values, [t for t, _ in values])
    assert trend.verdict(1.0) == "cannot say"


def test_what_is_always_the_same_explains_nothing() -> None:
    values = looks(40.0, 0.1)
    assert trend_of(values, [9.0] * len(values)) == trend_of(values)
