from covista_service.telemetry import Telemetry
from prometheus_client import generate_latest


def test_nothing_measured_is_none() -> None:
    summary = Telemetry().summary()
    assert (summary.surveys, summary.latency_p50_ms, summary.latency_p99_ms) == (0, None, None)


def test_quantiles_of_latencies() -> None:
    telemetry = Telemetry()
    for hundredth in range(100):
        telemetry.grouped((99 - hundredth) / 1000)
    summary = telemetry.summary()
    assert (summary.latency_p50_ms, summary.latency_p99_ms) == (50, 99)


def test_jobs_under_way_are_those_started_and_not_ended() -> None:
    telemetry = Telemetry()
    telemetry.started()
    telemetry.started()
    telemetry.ended()
    telemetry.surveyed("measured")
    assert telemetry.summary().under_way == 1
    text = generate_latest(telemetry.registry).decode()
    assert "covista_jobs_under_way 1.0" in text
    assert 'covista_surveys_total{outcome="measured"} 1.0' in text


def test_two_stations_in_one_process_do_not_share_their_counts() -> None:
    first, second = Telemetry(), Telemetry()
    first.received("pose", 3)
    assert (first.summary().poses_received, second.summary().poses_received) == (3, 0)
