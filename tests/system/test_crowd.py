"""A crowd and a station: all that is sent is accounted for, and images match within tiles only."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import httpx
from covista_clients.simulation.antenna import antenna
from covista_clients.simulation.crowd import Crowd
from covista_clients.simulation.marching import March, march
from covista_clients.simulation.pacing import RealTime
from covista_clients.simulation.stock import StockOptions, make
from covista_schemas.reports import FoundBy, PairsReport, RobotsReport, Status

from tests.service.deadline import wait_until
from tests.system.running_station import running_station, settings_for

TILE, ROBOTS, STEPS = 3, 8, 3
PLAN = March(rate_hz=2.0, pose_rate_hz=4.0, seconds=1.5)


def test_a_crowd_is_accounted_for_and_grouped_tile_by_tile(tmp_path: Path) -> None:
    stock = make(StockOptions(robots=TILE, world="wall", steps=STEPS, step_s=0.2, features=250))
    assert stock is not None
    crowd, stop = Crowd(stock, ROBOTS), threading.Event()
    settings = settings_for(tmp_path)
    with (
        running_station(settings) as station,
        httpx.Client(base_url=f"{station.url}/api/v1", timeout=10) as client,
        antenna(settings.link[0], "default", crowd.names, stop) as raised,
    ):
        assert raised is not None
        assert raised.await_heard(stop)
        wait_until(lambda: client.get(f"{station.url}/readyz").is_success, "compiled code is loaded", 120)

        def robots() -> RobotsReport:
            return RobotsReport.model_validate_json(client.get("/robots").content)

        def pairs() -> PairsReport:
            return PairsReport.model_validate_json(client.get("/pairs").content)

        sent = march(crowd, raised, PLAN, RealTime(stop), time.time_ns())
        # What is late is skipped.
        assert sent.keyframes + sent.poses + sent.skipped == 24 + 48
        assert sent.keyframes > 0
        wait_until(
            lambda: (
                sum(robot.keyframes.received - robot.keyframes.waiting for robot in robots().robots) == sent.keyframes
            ),
            "all keyframes are taken up",
        )
        wait_until(lambda: sum(robot.poses.received for robot in robots().robots) == sent.poses, "all poses are heard")
        for robot in robots().robots:
            assert robot.status is Status.LIVE
            assert robot.keyframes.received <= 3
            assert robot.poses.received <= 6
            assert robot.keyframes.missing == robot.poses.missing == 0
            assert robot.keyframes.dropped == {}
            assert robot.poses.dropped == {}
        in_company = {(f"r{a}", f"r{b}") for a, b in ((1, 2), (1, 3), (2, 3), (4, 5), (4, 6), (5, 6), (7, 8))}
        wait_until(
            lambda: any(pair.found_by is FoundBy.IMAGE for pair in pairs().pairs), "images of one tile are matched"
        )
        assert {(pair.a, pair.b) for pair in pairs().pairs if pair.found_by is FoundBy.IMAGE} <= in_company
