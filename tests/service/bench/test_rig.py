"""The benches that load a station, all on one small one."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator

import pytest
from covista_clients.simulation.marching import March
from covista_service.bench import memory, overload, scale
from covista_service.bench.load import LoadOptions, Sent
from covista_service.bench.overload import Times
from covista_service.bench.prober import Prober
from covista_service.bench.rig import LoadError, Rig, expect, free_endpoint, rig
from covista_service.demo import children

ROBOTS = 4


@pytest.fixture(scope="module")
def running() -> Iterator[Rig]:
    with rig(LoadOptions(free_endpoint(), robots=ROBOTS, features=100)) as made:
        yield made


def test_robots_take_memory(running: Rig) -> None:
    empty_mb, full_mb = memory.filled(running, ROBOTS, 5.0)
    assert all(20 < mb < 2000 for mb in (empty_mb, full_mb))
    assert running.watch.keyframes().received > 0


def test_a_window_is_what_happened_in_it(running: Rig) -> None:
    before = running.march(March(1.0, 1.0, 0.0))
    nothing, sent = running.window(March(1.0, 1.0, 0.0), before)
    assert (nothing.keyframes, nothing.poses, nothing.skipped) == (0, 0, 0)
    window, after = running.window(March(1.0, 2.0, 2.0), sent)
    # What is late is skipped.
    assert window.keyframes + window.poses + window.skipped == 8 + 16
    assert 0 < window.keyframes <= 8
    assert 0 < window.poses <= 16
    assert after.keyframes == sent.keyframes + window.keyframes
    assert after.poses == sent.poses + window.poses
    assert window.seconds >= 2.0
    assert len(window.latencies_ms) == pytest.approx(window.surveyed_per_s * window.seconds)
    assert 0 < window.regrouping_s < window.cpu_s < 1.1 * (os.cpu_count() or 1) * window.seconds
    assert running.settle()
    assert running.accounted(after)
    assert not running.accounted(Sent(after.keyframes + 1, 0, 0.0))


def test_a_window_without_a_keyframe_in_the_groups_has_no_latency(running: Rig) -> None:
    window, _ = running.window(March(1.0, 0.0, 0.0), Sent(0, 0, 0.0))
    with pytest.raises(LoadError, match="no keyframe"):
        window.latency_ms(0.5)


def test_work_a_keyframe_is_measured(running: Rig) -> None:
    size = scale.measure(running, ROBOTS, settle_s=5.0, window_s=1.0, saturated_s=1.0)
    # As many in all, however many robots, but for those that are late.
    assert len(size.windows) == 3
    assert all(6 - window.skipped <= window.keyframes <= 6 for window in size.windows)
    assert 0 < size.saturated.keyframes <= 80
    assert size.saturated.keyframes + size.saturated.skipped >= 80
    assert all(0 <= surveys < 20 for surveys in size.surveys)
    assert all(cpu_ms > 0 for cpu_ms in size.cpu_ms)
    assert size.turns_ms


def test_memory_is_looked_at_while_robots_send(running: Rig) -> None:
    looks = memory.observed(running, 3.0)
    assert 0 < len(looks) <= 7
    assert looks == sorted(looks, key=lambda look: look[0])
    assert all(20 < mb < 2000 for _, mb in looks)


def test_an_ordeal_has_all_its_parts(running: Rig) -> None:
    found = overload.ordeal(running, ROBOTS, Times(1.0, 2.0, 1.0, 2.0))
    assert found.astray == 0
    assert found.not_live == 0
    assert 0 < found.poses_used <= 1
    assert found.taken_per_s > 0
    assert found.sent_per_s > 0
    assert found.quiet.times_ms
    assert found.pressed.times_ms
    assert found.quiet.failures == 0


def test_a_prober_counts_what_is_not_answered(running: Rig) -> None:
    with Prober(running.url, {"/api/v1/robots/nobody": 5.0}) as prober:
        answers = prober.answers()
        while not answers.times_ms:
            answers = prober.answers()
    assert answers.failures == len(answers.times_ms)


def test_an_answer_that_still_stands_is_an_answer(running: Rig) -> None:
    with Prober(running.url, {"/api/v1/similarity": 20.0, "/metrics": 20.0}) as prober:
        count = failures = 0
        while count < 6:
            answers = prober.answers()
            count, failures = count + len(answers.times_ms), failures + answers.failures
    assert failures == 0


def test_a_station_that_cannot_start_says_why() -> None:
    endpoint = free_endpoint()
    taken = socket.create_server(("127.0.0.1", int(endpoint.rpartition(":")[2])))
    with taken, pytest.raises(LoadError), rig(LoadOptions(endpoint, robots=1, features=100)):
        pass


def test_who_ends_too_early_is_an_error() -> None:
    child = children.start("tests.service.demo.deaf")
    child.line.connection.close()
    child.end()
    with pytest.raises(LoadError, match="ended before it said Sent"):
        expect(child, Sent)
