from __future__ import annotations

from covista_clients.simulation.marching import March
from covista_service.bench.latency import free_endpoint, under_load
from covista_service.bench.load import LoadOptions


def test_a_load_is_accounted_for_to_the_last_keyframe() -> None:
    options = LoadOptions(free_endpoint(), robots=3, features=150)
    windows, all_counted = under_load(options, March(2.0, 2.0, 1.0))
    assert all_counted
    assert [window.keyframes + window.poses + window.skipped for window in windows] == [12] * 4
    assert all(0 < window.keyframes <= 6 and 0 < window.poses <= 6 for window in windows)
    assert sum(window.surveys for window in windows) > 0
    latencies_ms = [latency_ms for window in windows for latency_ms in window.latencies_ms]
    assert 0 < len(latencies_ms) <= 24
    assert min(latencies_ms) > 0
    assert all(window.cpu_s > window.regrouping_s > 0 for window in windows)
    assert all(window.turns_ms for window in windows)
