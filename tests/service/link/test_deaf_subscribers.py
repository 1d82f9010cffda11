"""Subscribers that are stopped, or that do not come back from their callback, in processes of their own."""

import select
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime

import psutil
import pytest
import zenoh
from covista_schemas import keys
from covista_schemas.reports import EventKind, EventReport
from covista_service.link.publish import Publisher
from covista_service.loop import News
from covista_service.station.station import Station
from zenoh import ext

from tests.service.deadline import wait_until
from tests.service.link.conftest import Air

SITE = "deaf"
LISTENER = """
import sys, threading, zenoh
from covista_schemas.zenoh_config import config
from zenoh import ext

def hear(sample):
    print("heard", flush=True)
    threading.Event().wait()

with zenoh.open(config("client", connect=[sys.argv[1]])) as session:
    ext.declare_advanced_subscriber(session, sys.argv[2], hear, history=ext.HistoryConfig(detect_late_publishers=True))
    print("up", flush=True)
    threading.Event().wait()
"""
# Enough to fill whatever lies between two processes, several times.
EVENTS, TEXT_BYTES, AT_A_TIME = 3000, 50_000, 10


@contextmanager
def listener(air: Air) -> Iterator[subprocess.Popen[str]]:
    """A subscriber that hears one event and is never heard of again."""
    command = [sys.executable, "-c", LISTENER, air.endpoint, keys.events(SITE)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def said(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def said_no_more(process: subprocess.Popen[str]) -> bool:
    assert process.stdout is not None
    return not select.select([process.stdout], [], [], 0)[0]


def news(first: int) -> News:
    events = [
        EventReport(
            id=first + i,
            event=EventKind.WARNING,
            time=datetime.now(UTC),
            robots=[],
            labels=[],
            revision_before=None,
            revision_after=None,
            text="x" * TEXT_BYTES,
        )
        for i in range(AT_A_TIME)
    ]
    return News(Station().snapshot(0), tuple(events), False, ())


@pytest.mark.parametrize("stopped", [True, False], ids=["stopped", "stuck"])
def test_who_does_not_listen_costs_the_others_nothing(air: Air, stopped: bool) -> None:
    publisher = Publisher(air.station, SITE)
    heard: list[int] = []
    before_bytes = psutil.Process().memory_info().rss

    def hear(sample: zenoh.Sample) -> None:
        heard.append(EventReport.model_validate_json(sample.payload.to_bytes()).id)

    history = ext.HistoryConfig(detect_late_publishers=True)
    with (
        listener(air) as deaf,
        ext.declare_advanced_subscriber(air.rover, keys.events(SITE), hear, history=history),
    ):
        assert said(deaf) == "up"
        publisher.take(news(0))
        assert said(deaf) == "heard"
        wait_until(lambda: len(heard) == AT_A_TIME)
        if stopped:
            deaf.send_signal(signal.SIGSTOP)
        for first in range(AT_A_TIME, EVENTS, AT_A_TIME):
            publisher.take(news(first))
            wait_until(lambda last=first + AT_A_TIME - 1: heard[-1] == last, "the last event")
        assert said_no_more(deaf)
        # Zenoh waits five seconds for a link that does not move, all others with it, and then cuts it.
        assert stopped or len(air.station.info.transports()) == 2
        grown_bytes = psutil.Process().memory_info().rss - before_bytes
        publisher.close()
    assert heard == list(range(EVENTS))
    assert grown_bytes < EVENTS * TEXT_BYTES / 3
    assert not [thread for thread in threading.enumerate() if thread.name == "covista-publish"]
