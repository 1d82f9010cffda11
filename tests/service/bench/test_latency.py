from __future__ import annotations

from covista_service.bench.latency import free_endpoint, under_load
from covista_service.bench.load import LoadOptions


def test_a_load_is_accounted_for_to_the_last_keyframe() -> None:
    options = LoadOptions(free_endpoint(), seconds=2.0, robots=3, period_s=0.5, features=150)
    summary, all_counted = under_load(options)
    assert all_counted
    assert summary.keyframes_received <= 12
    assert summary.surveys > 0
    assert summary.latency_p50_ms is not None
    assert summary.latency_p99_ms is not None
    assert 0 < summary.latency_p50_ms <= summary.latency_p99_ms
