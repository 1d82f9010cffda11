from __future__ import annotations

import numpy as np
import pytest
from covista_service.bench.memory import Trend, trend_of


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
    assert trend_of(looks(150.0, 0.0)).share == pytest.approx(20 / 305, rel=0.01)


@pytest.mark.parametrize(
    ("slope", "margin", "share", "flat"),
    [(0, 0, 0, True), (5, 6, 0.5, True), (-50, 1, -0.1, True), (5, 1, 0.009, True), (5, 1, 0.011, False)],
)
def test_flat_is_what_cannot_be_told_from_no_growth_or_is_none_to_speak_of(
    slope: float, margin: float, share: float, flat: bool
) -> None:
    assert Trend(slope, margin, share).flat is flat


def test_a_few_looks_are_enough() -> None:
    assert trend_of([(t, 100.0) for t in range(4)]).slope == 0
