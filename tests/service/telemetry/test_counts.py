from concurrent.futures import ThreadPoolExecutor

import pytest
from covista_service.telemetry import Telemetry


def sample(telemetry: Telemetry, name: str, **labels: str) -> float | None:
    return telemetry.registry.get_sample_value(name, labels)


def test_nothing_measured_is_none() -> None:
    summary = Telemetry().summary()
    assert (summary.surveys, summary.latency_p50_ms, summary.latency_p99_ms) == (0, None, None)


def test_quantiles_of_latencies() -> None:
    telemetry = Telemetry()
    for hundredth in range(100):
        telemetry.grouped((99 - hundredth) / 1000)
    summary = telemetry.summary()
    assert (summary.latency_p50_ms, summary.latency_p99_ms) == (50, 99)


def test_a_latency_of_ten_seconds_has_a_bucket_of_its_own() -> None:
    telemetry = Telemetry()
    telemetry.grouped(9.9)
    assert sample(telemetry, "covista_keyframe_to_groups_seconds_bucket", le="5.0") == 0
    assert sample(telemetry, "covista_keyframe_to_groups_seconds_bucket", le="10.0") == 1


def test_jobs_under_way_are_those_started_and_not_ended() -> None:
    telemetry = Telemetry()
    telemetry.started("compare")
    telemetry.started("compare")
    telemetry.started("build")
    telemetry.ended("compare")
    telemetry.surveyed("measured")
    assert telemetry.summary().under_way == 2
    under_way = {
        kind: sample(telemetry, "covista_jobs_under_way", kind=kind) for kind in ("extract", "compare", "build")
    }
    assert under_way == {"extract": 0, "compare": 1, "build": 1}
    assert sample(telemetry, "covista_surveys_total", outcome="measured") == 1


def test_jobs_are_timed_by_kind_from_any_thread() -> None:
    telemetry = Telemetry()
    with ThreadPoolExecutor(4) as threads:
        for _ in range(400):
            threads.submit(telemetry.worked, "build", 0.25)
    assert sample(telemetry, "covista_job_seconds_count", kind="build") == 400
    assert sample(telemetry, "covista_job_seconds_sum", kind="build") == 100
    assert sample(telemetry, "covista_job_seconds_count", kind="extract") == 0


def test_work_is_told_apart_from_waiting() -> None:
    telemetry = Telemetry()
    telemetry.worked("compare", 0.75)
    telemetry.took("compare", 0.25)
    assert sample(telemetry, "covista_job_seconds_sum", kind="compare") == 0.75
    assert sample(telemetry, "covista_work_seconds_sum", kind="compare") == 0.25


@pytest.mark.parametrize("stage", ["turn", "reading", "regroup"])
def test_stages_are_timed_by_the_timer_given_also_when_they_fail(stage: str) -> None:
    times_s = iter([1.0, 1.5, 7.0, 9.0])
    telemetry = Telemetry(timer=lambda: next(times_s))
    with telemetry.timed(stage):
        pass
    with pytest.raises(ZeroDivisionError), telemetry.timed(stage):
        raise ZeroDivisionError
    assert sample(telemetry, f"covista_{stage}_seconds_count") == 2
    assert sample(telemetry, f"covista_{stage}_seconds_sum") == 2.5


def test_two_stations_in_one_process_do_not_share_their_counts() -> None:
    first, second = Telemetry(), Telemetry()
    first.received("pose", 3)
    first.fault("loop")
    assert (first.summary().poses_received, second.summary().poses_received) == (3, 0)
    assert (
        sample(first, "covista_faults_total", where="loop"),
        sample(second, "covista_faults_total", where="loop"),
    ) == (1, 0)
