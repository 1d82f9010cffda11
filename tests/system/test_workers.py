"""A real station, a real Dask cluster, real robots over real zenoh; and workers and schedulers that die."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

import pytest
import zenoh
from covista_clients import MissionControl
from covista_schemas import keys
from covista_schemas.reports import FoundBy, PartHealth
from covista_schemas.zenoh_config import config
from covista_service.workers import load

from tests.service.deadline import wait_until
from tests.service.wall import keyframe_bytes, overlap
from tests.service.workers.dask_cluster import DaskCluster, dask_cluster
from tests.system.running_station import running_station, settings_for

ROBOTS = {f"r{k}": 0.5 * k for k in range(5)}
PAIRS = list(combinations(ROBOTS, 2))
# Starting workers, and compiling on a fresh machine, takes a while.
pytestmark = pytest.mark.timeout(300)


@dataclass
class Swarm:
    """Robots beside one another before a wall, and what mission control hears of them."""

    control: MissionControl
    air: zenoh.Session
    sent: int = 0
    boot: str = field(default="b0")

    def send(self) -> None:
        """Let every robot send its next keyframe, of features."""
        for robot, x_m in ROBOTS.items():
            data = keyframe_bytes(robot, x_m, sequence=self.sent, boot=self.boot)
            # Zenoh would rather drop one than wait, where the machine is busy.
            self.air.put(keys.keyframe("default", robot), data, congestion_control=zenoh.CongestionControl.BLOCK)
        self.sent += 1

    def measured(self) -> list[tuple[str, str]]:
        """Pairs of which the newest keyframes were surveyed, and answered rightly."""
        found = {(pair.a, pair.b): pair for pair in self.control.pairs().pairs}
        return [
            names
            for names in PAIRS
            if (pair := found.get(names)) is not None
            and pair.found_by is FoundBy.IMAGE
            and pair.keyframes is not None
            and {pair.keyframes.a.sequence, pair.keyframes.b.sequence} == {self.sent - 1}
            and pair.overlap_a == pytest.approx(overlap(ROBOTS[names[1]] - ROBOTS[names[0]]), abs=0.07)
        ]

    def all_measured(self) -> bool:
        return self.measured() == PAIRS

    def workers(self) -> PartHealth:
        return self.control.ready().parts["workers"]


@contextmanager
def swarm_at(cluster: DaskCluster, folder: Path) -> Iterator[Swarm]:
    with (
        running_station(settings_for(folder, workers=cluster.url)) as station,
        MissionControl(station.url) as control,
        zenoh.open(config("client", connect=[station.link[0]])) as air,
    ):
        yield Swarm(control, air)


@pytest.fixture
def cluster() -> Iterator[DaskCluster]:
    load()
    with dask_cluster() as cluster:
        yield cluster


def test_a_worker_is_killed_and_every_pair_is_surveyed(cluster: DaskCluster, tmp_path: Path) -> None:
    cluster.scheduler()
    workers = [cluster.worker() for _ in range(2)]
    with swarm_at(cluster, tmp_path) as swarm:
        both = PartHealth(status="ready", detail=f"4 jobs at {cluster.url}")
        wait_until(lambda: swarm.workers() == both, "both workers are ready", 60)
        swarm.send()
        wait_until(swarm.measured, "some pairs are measured")
        swarm.send()
        cluster.kill(workers[0])
        swarm.send()
        wait_until(swarm.all_measured, "every pair is measured", 30)
        one = PartHealth(status="ready", detail=f"2 jobs at {cluster.url}")
        wait_until(lambda: swarm.workers() == one, "one worker is left")
        assert swarm.control.ready().status == "ready"
        assert [each.last_problem for each in swarm.control.robots().robots] == [None] * len(ROBOTS)


def test_a_station_goes_on_without_a_scheduler_and_goes_back_to_it(cluster: DaskCluster, tmp_path: Path) -> None:
    """From its start on: first there is no scheduler, then there is one, then it is killed, then there is another."""
    with swarm_at(cluster, tmp_path) as swarm:
        for _ in range(2):
            wait_until(lambda: swarm.workers().status == "degraded", "the cluster is away")
            wait_until(lambda: swarm.control.ready().status == "degraded", "the station says so", 60)
            detail = str(swarm.workers().detail)
            assert f"{cluster.url} is away" in detail
            assert detail.endswith("2 threads here")
            swarm.send()
            wait_until(swarm.all_measured, "every pair is measured here", 30)
            scheduler, _ = cluster.scheduler(), cluster.worker()
            wait_until(lambda: swarm.workers().detail == f"2 jobs at {cluster.url}", "it is there again", 60)
            swarm.send()
            wait_until(swarm.measured, "some pairs are measured there", 30)
            cluster.kill(scheduler)
