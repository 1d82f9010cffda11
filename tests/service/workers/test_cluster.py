import asyncio
import logging
import os
import signal
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from covista_service.workers import JobLostError, load
from covista_service.workers.cluster import Cluster, _left_behind
from covista_service.workers.connection import unlike
from covista_service.workers.jobs import Job
from distributed.client import AllExit

from tests.service.deadline import free_endpoint, wait_until
from tests.service.workers.dask_cluster import DaskCluster, dask_cluster
from tests.service.workers.orders import die, die_once, order, pid, stay_once

# The first one may have to wait for the compiler.
pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    """What a fresh machine has to compile first, so that no worker below is waited for while it does."""
    load()


@pytest.fixture(scope="module")
def dask() -> Iterator[DaskCluster]:
    with dask_cluster() as cluster:
        cluster.scheduler()
        yield cluster


@pytest.fixture(scope="module")
def jobs_here(dask: DaskCluster) -> Iterator[Cluster]:
    cluster = Cluster(dask.url.removeprefix("dask://"), 1, deadline_s=2.0)
    yield cluster
    cluster.close()


@pytest.fixture
def cluster(dask: DaskCluster, jobs_here: Cluster) -> Cluster:
    """With two workers at least, whatever the test before has done to them; each can take two jobs."""
    ready = jobs_here.status()
    for _ in range(2 - (0 if ready.fallback else ready.capacity // 2)):
        dask.worker()
    wait_until(lambda: (now := jobs_here.status()).fallback is None and now.capacity >= 4, "two workers", 60)
    return jobs_here


def test_jobs_spread_over_the_workers(cluster: Cluster) -> None:
    jobs = [cluster.submit(pid()) for _ in range(20)]
    assert len({job.result(30) for job in jobs}) == 2


def test_the_death_of_one_costs_no_job(cluster: Cluster, tmp_path: Path) -> None:
    before = cluster.status()
    jobs = [cluster.submit(die_once(tmp_path / "mark")), *(cluster.submit(pid()) for _ in range(10))]
    assert jobs[0].result(30) == ("survived",)
    assert all(job.exception(30) is None for job in jobs)
    after = cluster.status()
    assert (after.lost - before.lost, after.given_up) == (1, before.given_up)
    assert after.retried > before.retried


def test_a_worker_that_hangs_has_no_jobs_until_it_answers(cluster: Cluster) -> None:
    numbers = {cluster.submit(pid()).result(30)[0] for _ in range(4)} | pids(cluster, 20)
    stopped, other = sorted(numbers)
    os.kill(stopped, signal.SIGSTOP)
    try:
        assert all(job.exception(60) is None for job in [cluster.submit(pid()) for _ in range(8)])
        assert "did not answer within 2 s" in str(wait_until(lambda: cluster.status().remark))
        before = cluster.status()
        assert pids(cluster, 20) == {other}
        assert cluster.status() == before
    finally:
        os.kill(stopped, signal.SIGCONT)
    wait_until(lambda: cluster.status().remark is None, "it answers again", 60)
    assert cluster.status().capacity == before.capacity + 2
    wait_until(lambda: pids(cluster, 20) == {stopped, other}, "both have jobs", 60)


def pids(cluster: Cluster, count: int) -> set[int]:
    """Who does so many jobs that come at once."""
    return {job.result(30)[0] for job in [cluster.submit(pid()) for _ in range(count)]}


def test_a_job_that_kills_whoever_touches_it_is_given_up(cluster: Cluster) -> None:
    before = cluster.status()
    with pytest.raises(JobLostError, match=r"workers died of it: tcp://.*, tcp://"):
        cluster.submit(die()).result(60)
    wait_until(lambda: cluster.status().lost - before.lost == 2)
    assert cluster.status().given_up - before.given_up == 1
    assert "has no workers: 1 threads here" in str(wait_until(lambda: cluster.status().fallback))
    assert cluster.submit(Job(tuple, ())).result(30) == ()


def test_where_no_other_worker_is_left_what_killed_one_does_not_kill_the_station(
    dask: DaskCluster, cluster: Cluster, tmp_path: Path
) -> None:
    """It is tried in a process of its own."""
    with pytest.raises(JobLostError):
        cluster.submit(die()).result(60)
    wait_until(lambda: cluster.status().fallback)
    dask.worker()
    wait_until(lambda: cluster.status().fallback is None, "one worker", 60)
    assert cluster.submit(die_once(tmp_path / "mark")).result(60) == ("survived",)


def test_a_job_that_does_not_return_is_done_here(cluster: Cluster, tmp_path: Path) -> None:
    before = cluster.status()
    assert cluster.submit(stay_once(tmp_path / "mark")).result(60) == ("returned",)
    after = cluster.status()
    assert (after.overdue - before.overdue, after.retried - before.retried) == (1, 1)


def test_errors_of_jobs_come_back(cluster: Cluster) -> None:
    with pytest.raises(ZeroDivisionError):
        cluster.submit(order("1 / 0")).result(30)


def test_closing_drops_jobs_and_leaves_no_thread(dask: DaskCluster, cluster: Cluster) -> None:
    before = set(threading.enumerate())
    other = Cluster(dask.url.removeprefix("dask://"), 1)
    wait_until(lambda: other.status().fallback is None, "connected", 60)
    jobs = [other.submit(order("__import__('threading').Event().wait(5)")) for _ in range(4)]
    other.close()
    assert all(job.done() for job in jobs)
    assert other.submit(pid()).cancelled()
    wait_until(lambda: set(threading.enumerate()) <= before, "no thread is left")


@pytest.mark.parametrize("listens", [True, False])
def test_without_a_scheduler_jobs_are_done_here(listens: bool) -> None:
    """Whether nobody listens, or somebody who is no scheduler."""
    with socket.socket() as mute:
        port = free_endpoint().rpartition(":")[2]
        if listens:
            mute.bind(("127.0.0.1", int(port)))
            mute.listen()
        cluster = Cluster(f"127.0.0.1:{port}", 2)
        assert cluster.submit(Job(tuple, ())).result(30) == ()
        status = cluster.status()
        assert (status.kind, status.capacity) == ("dask", 2)
        assert f"dask://127.0.0.1:{port} is away" in str(status.fallback)
        cluster.close()


def test_software_that_differs_is_named() -> None:
    from importlib.metadata import version

    assert unlike(version("covista")) is None
    assert unlike("0.0.1") == f"has covista 0.0.1, not {version('covista')}"
    assert unlike(ModuleNotFoundError()) == "has no covista"


def test_what_dask_leaves_behind_is_no_error_and_all_else_is(caplog: pytest.LogCaptureFixture) -> None:
    loop = asyncio.new_event_loop()
    try:
        for error, said in ((AllExit(), []), (ValueError("ours"), ["left by us"])):
            caplog.clear()
            _left_behind(loop, {"message": "left by us", "exception": error})
            assert [record.getMessage() for record in caplog.records if record.levelno >= logging.ERROR] == said
    finally:
        loop.close()
