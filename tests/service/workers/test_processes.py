import errno
import os
import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from covista_service.perception.comparison import Outcome
from covista_service.workers import JobLostError, Workers, WorkersOptions, load, processes
from covista_service.workers.child import Child
from covista_service.workers.processes import Processes

from tests.service.deadline import wait_until
from tests.service.workers.orders import die, die_once, order, pid, stay_once
from tests.service.workers.pairs import pair

# The first one may have to wait for the compiler.
pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    """What a fresh machine has to compile first, so that no worker below is waited for while it does."""
    load()


@pytest.fixture(scope="module")
def pool() -> Iterator[Processes]:
    pool = Processes(2, deadline_s=2.0)
    wait_until(lambda: pool.status().warm, "processes are warm", 60)
    yield pool
    pool.close()


def test_processes_are_warm_before_their_first_job(pool: Processes) -> None:
    asked = "__import__('covista_service.perception.warming', fromlist='*').warm_up.cache_info().currsize"
    assert pool.submit(order(asked)).result(30) == (1,)


def test_the_death_of_one_costs_no_job(pool: Processes, tmp_path: Path) -> None:
    before = pool.status()
    jobs = [pool.submit(die_once(tmp_path / "mark")), *(pool.submit(pid()) for _ in range(6))]
    assert jobs[0].result(30) == ("survived",)
    assert all(job.exception(30) is None for job in jobs)
    after = pool.status()
    assert (after.lost - before.lost, after.retried - before.retried, after.given_up) == (1, 1, before.given_up)


def test_a_job_that_kills_whoever_touches_it_is_given_up(pool: Processes) -> None:
    before = pool.status()
    poison, good = pool.submit(die()), pool.submit(pid())
    with pytest.raises(JobLostError, match="2 workers died of it"):
        poison.result(60)
    assert good.exception(30) is None
    after = pool.status()
    assert (after.lost - before.lost, after.given_up - before.given_up) == (2, 1)
    assert pool.submit(pid()).exception(30) is None


def test_a_job_that_does_not_return_is_done_again(pool: Processes, tmp_path: Path) -> None:
    before = pool.status()
    assert pool.submit(stay_once(tmp_path / "mark")).result(60) == ("returned",)
    after = pool.status()
    assert (after.overdue - before.overdue, after.retried - before.retried) == (1, 1)


def test_one_that_died_while_idle_costs_no_job(pool: Processes) -> None:
    before = pool.status()
    (number,) = pool.submit(pid()).result(30)
    child = psutil.Process(number)
    child.kill()
    wait_until(lambda: not child.is_running() or child.status() == psutil.STATUS_ZOMBIE)
    assert {pool.submit(pid()).result(30)[0] for _ in range(4)}.isdisjoint({number})
    assert pool.status().lost - before.lost == 1


def shared_memory() -> int:
    """How many arenas this process holds."""
    return sum("covista-features" in _target(link) for link in Path("/proc/self/fd").iterdir())


def _target(link: Path) -> str:
    try:
        return os.readlink(link)
    except OSError:
        return ""


class Starts:
    """Starts processes as long as there is memory for them."""

    def __init__(self, last: int) -> None:
        self.left = last
        self.children: list[Child] = []

    def __call__(self, arena: str | None) -> Child:
        if self.left == 0:
            raise OSError(errno.ENOMEM, "no memory")
        self.left -= 1
        self.children.append(Child(arena))
        return self.children[-1]


@pytest.mark.usefixtures("pool")
def test_where_processes_cannot_be_started_none_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    starts, arenas = Starts(1), shared_memory()
    monkeypatch.setattr(processes, "Child", starts)
    with pytest.raises(OSError, match="no memory"):
        Processes(2)
    assert not starts.children[0].alive
    assert shared_memory() == arenas


def test_while_no_other_can_be_started_jobs_go_to_those_that_live(monkeypatch: pytest.MonkeyPatch) -> None:
    starts = Starts(2)
    monkeypatch.setattr(processes, "Child", starts)
    pool = Processes(2)
    wait_until(lambda: pool.status().warm, "processes are warm", 60)
    numbers = {pool.submit(pid()).result(60)[0] for _ in range(8)}
    psutil.Process(numbers.pop()).kill()
    assert {pool.submit(pid()).result(60)[0] for _ in range(4)} == numbers
    (only,) = numbers
    psutil.Process(only).kill()
    with pytest.raises(JobLostError):
        pool.submit(pid()).result(60)
    assert (pool.status().lost, pool.status().given_up) == (2, 1)
    starts.left = 2
    assert len({pool.submit(pid()).result(60)[0] for _ in range(4)} - numbers) >= 1
    assert pool.status().lost == 2
    pool.close()


@pytest.mark.parametrize("words", ["1 / 0", "__import__('threading').Lock()", "(_ for _ in ()).throw(EOFError())"])
def test_errors_and_results_that_cannot_travel_come_back_as_errors(pool: Processes, words: str) -> None:
    before = pool.status()
    job = pool.submit(order(words))
    assert job.exception(30) is not None
    assert "1 / 0" not in words or isinstance(job.exception(), ZeroDivisionError)
    assert pool.status() == before


def test_where_memory_is_not_shared_features_travel_by_value(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "memfd_create")
    workers = Workers(WorkersOptions("processes", count=1))
    job = pair()
    size = sum(
        one.features.keypoints_px.nbytes + one.features.descriptors.nbytes for one in (job.first_view, job.second_view)
    )
    assert [workers.survey(job).result(60).outcome for _ in range(2)] == [Outcome.MEASURED] * 2
    assert workers.status().shipped_bytes == 2 * size
    workers.close()


def test_closing_ends_even_who_does_not_return() -> None:
    before = set(threading.enumerate())
    pool = Processes(1)
    (number,) = pool.submit(pid()).result(60)
    jobs = [pool.submit(order("__import__('threading').Event().wait()")) for _ in range(3)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pool.close()
    assert not psutil.pid_exists(number)
    assert all(job.done() for job in jobs)
    assert set(threading.enumerate()) == before
    assert (pool.status().lost, pool.status().retried, pool.status().given_up) == (0, 0, 0)
    with pytest.raises(RuntimeError):
        pool.submit(pid())


_STATION = """
import sys
from covista_service.workers import Workers, WorkersOptions
from tests.service.workers.pairs import pair
if __name__ == "__main__":
    workers = Workers(WorkersOptions("processes", count=2))
    job = pair()
    workers.survey(job).result()
    print("ready", flush=True)
    sys.stdin.read()
    workers.close()
"""


def _station() -> subprocess.Popen[bytes]:
    path = os.pathsep.join(each for each in (*sys.path, str(Path(__file__).parents[3])) if each)
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", _STATION],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": path},
    )


@pytest.mark.parametrize("killed", [True, False])
def test_a_station_leaves_nothing_however_it_ends(killed: bool) -> None:
    """No process, no shared memory with a name, and not a word about either."""
    named = set(Path("/dev/shm").iterdir()) if Path("/dev/shm").exists() else set()
    station = _station()
    assert station.stdin is not None
    assert station.stdout is not None
    assert station.stderr is not None
    with station.stdin, station.stdout, station.stderr:
        assert station.stdout.readline() == b"ready\n"
        family = psutil.Process(station.pid).children(recursive=True)
        assert len(family) >= 2
        if killed:
            os.kill(station.pid, signal.SIGKILL)
        else:
            station.stdin.close()
        status = station.wait()
        gone, alive = psutil.wait_procs(family, timeout=10)
        assert not alive, gone
        said = station.stderr.read()
    assert (status, said) == (-signal.SIGKILL if killed else 0, b"")
    assert (set(Path("/dev/shm").iterdir()) if Path("/dev/shm").exists() else set()) <= named
