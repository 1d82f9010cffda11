"""What a subscriber missed it is told when it is there again."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import pytest
import zenoh
from covista_clients.rover.link import follow
from covista_schemas import keys
from covista_schemas.reports import EventKind, EventReport, OwnGroupReport, time_of
from covista_schemas.zenoh_config import config
from covista_service.link.publish import EVENTS_KEPT, Publisher
from covista_service.link.session import open_session
from covista_service.loop import News
from covista_service.station.snapshot import GroupView, Snapshot

from tests.router_process import RouterProcess
from tests.service.deadline import free_endpoint, wait_until
from tests.service.link.conftest import Air
from tests.service.station.scenes import Scene

SITE = "missed"
ROVER = """
import sys
from covista_clients import Camera, Rover

camera = Camera(fx=60, fy=60, cx=31.5, cy=23.5, width=64, height=48)
with Rover("r1", camera, sys.argv[1], site=sys.argv[2]) as rover:
    rover.on_group(lambda group: print(group.model_dump_json(), flush=True))
    sys.stdin.read()
"""

# Prints what it hears of the events: with recovery, and beside it without.
LISTENERS = """
import sys
import zenoh
from covista_clients.rover.link import follow
from covista_schemas import keys
from covista_schemas.reports import EventReport
from covista_schemas.zenoh_config import config

def tell(name):
    # One write a line: two threads tell.
    return lambda sample: sys.stdout.write(f"{name} {EventReport.read(sample.payload.to_bytes()).id}\\n")

sys.stdout.reconfigure(line_buffering=True)
key = keys.events(sys.argv[2])
with zenoh.open(config("client", connect=[sys.argv[1]])) as session:
    subscribers = follow(session, key, tell("all")), session.declare_subscriber(key, tell("some"))
    print("ready", flush=True)
    sys.stdin.read()
"""


def events(first: int, last: int, text: str = "x") -> tuple[EventReport, ...]:
    return tuple(EventReport(id=i, event=EventKind.STATUS, time=time_of(i), text=text) for i in range(first, last + 1))


@contextmanager
def listening(script: str, endpoint: str, site: str) -> Iterator[subprocess.Popen[str]]:
    """The script in a process of its own."""
    command = [sys.executable, "-c", script, endpoint, site]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.fixture
def rover(air: Air) -> Iterator[subprocess.Popen[str]]:
    """A rover that prints what it is told of its group."""
    with listening(ROVER, air.endpoint, SITE) as process:
        yield process


def heard(rover: subprocess.Popen[str]) -> OwnGroupReport:
    assert rover.stdout is not None
    return OwnGroupReport.model_validate_json(rover.stdout.readline())


def with_label(snapshot: Snapshot, label: str) -> Snapshot:
    groups = replace(snapshot.groups, groups=(GroupView(label, ("r1",)),), revision=snapshot.groups.revision + 1)
    return replace(snapshot, groups=groups, robots={"r1": replace(snapshot.robots["r1"], group=label)})


def test_a_rover_that_sleeps_through_a_change_learns_of_it_when_it_wakes(
    air: Air, rover: subprocess.Popen[str]
) -> None:
    scene = Scene()
    scene.send("r1")
    scene.settle()
    publisher = Publisher(air.station, SITE)
    try:
        publisher.take(News(with_label(scene.snapshot, "g1"), (), True, ("r1",)))
        assert heard(rover).label == "g1"
        links = len(air.station.info.links())
        rover.send_signal(signal.SIGSTOP)
        wait_until(lambda: len(air.station.info.links()) < links, "its lease to run out")
        for label in ("g2", "g3"):
            publisher.take(News(with_label(scene.snapshot, label), (), True, ("r1",)))
            wait_until(lambda: publisher.status().waiting == 0)
        rover.send_signal(signal.SIGCONT)
        assert heard(rover).label == "g3"
    finally:
        publisher.close()


def test_events_told_while_the_router_was_away_arrive_in_order_and_all() -> None:
    station_at, router_at = free_endpoint(), free_endpoint()
    numbers: list[int] = []
    with RouterProcess(router_at) as router, open_session([station_at], [router_at]) as station:
        publisher = Publisher(station, SITE)
        with zenoh.open(config("client", connect=[router_at])) as session:
            subscriber = follow(
                session,
                keys.events(SITE),
                lambda sample: numbers.append(EventReport.read(sample.payload.to_bytes()).id),
            )
            publisher.take(News(Scene().snapshot, events(1, 20), False, ()))
            wait_until(lambda: len(numbers) == 20)
            router.kill()
            publisher.take(News(Scene().snapshot, events(21, 80), False, ()))
            wait_until(lambda: publisher.status().told == 80)
            router.start()
            wait_until(lambda: len(numbers) >= 80, "what was missed", 30.0)
            publisher.take(News(Scene().snapshot, events(81, 100), False, ()))
            wait_until(lambda: len(numbers) >= 100)
            subscriber.undeclare()
        publisher.close()
    assert numbers == list(range(1, 101))


def test_who_comes_late_hears_the_last_some_hundred_events_in_order(air: Air) -> None:
    publisher = Publisher(air.station, "late")
    numbers: list[int] = []
    try:
        publisher.take(News(Scene().snapshot, events(1, EVENTS_KEPT + 100), False, ()))
        wait_until(lambda: publisher.status().waiting == 0)
        subscriber = follow(
            air.rover,
            keys.events("late"),
            lambda sample: numbers.append(EventReport.read(sample.payload.to_bytes()).id),
        )
        wait_until(lambda: len(numbers) >= EVENTS_KEPT)
        publisher.take(News(Scene().snapshot, events(EVENTS_KEPT + 101, EVENTS_KEPT + 101), False, ()))
        wait_until(lambda: len(numbers) > EVENTS_KEPT)
        subscriber.undeclare()
    finally:
        publisher.close()
    assert numbers == list(range(101, EVENTS_KEPT + 102))


def test_what_a_busy_subscriber_was_not_sent_it_asks_for(air: Air) -> None:
    """It pauses for less than its lease, and more is told than the line to it holds."""
    heard: dict[str, list[int]] = {"all": [], "some": []}
    last, text = EVENTS_KEPT - 20, "x" * 40_000
    publisher = Publisher(air.station, "busy")
    probe = air.station.declare_publisher(keys.events("busy"))
    with listening(LISTENERS, air.endpoint, "busy") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        # What is told before the station's end knows of a subscriber, one without recovery never hears.
        wait_until(lambda: is_heard(probe))
        try:
            publisher.take(News(Scene().snapshot, events(1, 1), False, ()))
            while not (heard["all"] and heard["some"]):
                note(heard, process.stdout.readline())
            process.send_signal(signal.SIGSTOP)
            publisher.take(News(Scene().snapshot, events(2, last, text), False, ()))
            wait_until(lambda: publisher.status().waiting == 0 and publisher.status().told == last)
            process.send_signal(signal.SIGCONT)
            while len(heard["all"]) < last:
                note(heard, process.stdout.readline())
        finally:
            publisher.close()
    assert heard["all"] == list(range(1, last + 1))
    assert len(heard["some"]) < last


def is_heard(publisher: zenoh.Publisher) -> bool:
    # The stubs of zenoh call it a bool; it is an object that is always true.
    status: Any = publisher.matching_status
    return bool(status.matching)


def note(heard: dict[str, list[int]], line: str) -> None:
    name, number = line.split()
    heard[name].append(int(number))
