import asyncio
import json
from dataclasses import replace
from typing import Any

import pytest
from covista_service.dashboard.data_health import health, timings_of
from covista_service.dashboard.sources import Sources
from covista_service.telemetry import Telemetry

from tests.service.api.conftest import Desk


@pytest.fixture
def sources() -> Sources:
    desk = Desk()
    desk.scene.send("r1")
    desk.scene.settle()
    parts = desk.parts
    return Sources("here", parts.loop, parts.telemetry, parts.health, parts.vitals, parts.gate, parts.archive)


def test_timings_are_read_from_what_prometheus_is_told() -> None:
    telemetry = Telemetry()
    telemetry.grouped(0.2)
    telemetry.grouped(0.7)
    telemetry.fault("sink")
    timings = timings_of(telemetry.registry)
    assert (timings.latencies, timings.within_half_s) == (2, 1)
    assert timings.latency_sum_s == pytest.approx(0.9)
    assert timings.faults == {"loop": 0, "sink": 1, "station": 0}
    assert timings.memory_bytes is not None
    assert timings.memory_bytes > 1e6


async def _body(sources: Sources) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(bytes((await health(sources)).body))
    return found


def test_the_station_is_told_of_as_it_is(sources: Sources) -> None:
    crowded = replace(sources, listeners=lambda: 3, given_up=lambda: {"slow": 4})
    told = asyncio.run(_body(crowded))
    assert (told["station"], told["status"], told["robots"]) == ("here", "ready", "1 robot (1 live) in 1 group.")
    counts = {each["key"]: each["total"] for each in told["counts"]}
    assert counts["Client given up/slow"] == 4
    assert counts["Not let in on zenoh/unlisted"] == 3
    assert "3 listeners to events" in dict(told["facts"])["Who listens"]
