"""Streams of a station as it is served, and settings that outlive it."""

import time
from contextlib import ExitStack
from pathlib import Path

import httpx
from covista_service.serve import Running

from tests.service.api.live import Ear
from tests.service.deadline import wait_until
from tests.system.running_station import running_station, settings_for

# What a stop takes without any listener is part of it.
STOP_S = 3.0


class Door:
    """Where listeners find a station."""

    def __init__(self, station: Running) -> None:
        self.port = int(station.url.rsplit(":", 1)[1])


def ready(station: Running) -> None:
    wait_until(lambda: httpx.get(f"{station.url}/readyz").json()["status"] == "ready", "it is ready", 100)


def test_a_station_with_listeners_stops_soon_and_tells_each(tmp_path: Path) -> None:
    with ExitStack() as stack:
        with running_station(settings_for(tmp_path)) as station:
            ready(station)
            ears = [stack.enter_context(Ear(Door(station))) for _ in range(20)]
            deaf = stack.enter_context(Ear(Door(station), receive_bytes=2048))
            for ear in (*ears, deaf):
                ear.heartbeat()
            station.stop()
            begun_s = time.monotonic()
            for ear in ears:
                (cut,) = ear.rest()
                assert (cut.event, cut.data["title"]) == ("cut", "The station is stopping")
            assert time.monotonic() - begun_s < 1.0
        assert time.monotonic() - begun_s < STOP_S


def test_settings_given_while_it_ran_hold_after_a_restart_and_so_do_events(tmp_path: Path) -> None:
    settings = settings_for(tmp_path)
    with running_station(settings) as station:
        ready(station)
        with Ear(Door(station)) as ear:
            ear.heartbeat()
            patch = {"alpha": 0.75, "hysteresis": {"gain": 0.125}}
            assert httpx.patch(f"{station.url}/api/v1/settings", json=patch).status_code == 200
            event = ear.next()
            assert (event.event, event.data["by"]) == ("settings", None)
            assert event.data["text"] == "alpha is 0.75, was 0.5; hysteresis.gain is 0.125, was 0.05"
    with running_station(settings) as station:
        ready(station)
        live = httpx.get(f"{station.url}/api/v1/settings").json()
        assert (live["alpha"], live["hysteresis"]["gain"], live["hysteresis"]["smoothing"]) == (0.75, 0.125, 0.3)
        with Ear(Door(station), last=event.id - 1) as ear:
            assert ear.next() == event
