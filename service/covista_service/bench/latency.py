"""How long from a keyframe's arrival to the first groups that contain a survey of it, under a steady load?

Twenty robots send one keyframe of 500 features and one pose a second, from a process on the same machine.
"""

from __future__ import annotations

import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from typing import TypeVar

from covista_schemas.errors import CovistaError

from covista_service.bench import load
from covista_service.bench.load import LoadOptions, Prepared, Sent
from covista_service.bench.row import Row
from covista_service.config import Settings
from covista_service.demo import children
from covista_service.demo.children import Child
from covista_service.demo.run import STATION
from covista_service.demo.tidings import Failed, Ready
from covista_service.demo.watch import Watch
from covista_service.telemetry import Summary

MARKS_MS = {"p50": 100.0, "p99": 500.0}
_SECONDS, _LONG_SECONDS = 20.0, 120.0
_DRAIN_S = 5.0
_WARM_S = 120.0
_POLL_S = 0.1
_T = TypeVar("_T")


class LoadError(CovistaError):
    """Station or load did not do their part."""


def rows(long: bool) -> Iterator[Row]:
    """`latency/p50` and `latency/p99`; they hold only if every keyframe is accounted for."""
    summary, all_counted = under_load(LoadOptions(free_endpoint(), _LONG_SECONDS if long else _SECONDS))
    for case, figure in (("p50", summary.latency_p50_ms), ("p99", summary.latency_p99_ms)):
        if figure is None:
            raise LoadError("no keyframe came as far as the groups")
        yield Row(
            bench="latency",
            case=case,
            median=figure,
            spread=None,
            unit="ms",
            peer=None,
            peer_median=None,
            mark=f"<= {MARKS_MS[case]:g} ms, nothing lost uncounted",
            holds=figure <= MARKS_MS[case] and all_counted,
        )


def under_load(options: LoadOptions) -> tuple[Summary, bool]:
    """What a station measured of itself under a load, and whether every keyframe sent was received or missed."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="covista-", ignore_cleanup_errors=True))
        database = f"sqlite:///{folder}/covista.db"
        settings = Settings(api="127.0.0.1:0", link=(options.connect,), database=database, log_level="warning")
        robots = children.start(load.__name__, options)
        stack.callback(robots.end)
        _expect(robots, Prepared)
        station = children.start(STATION, settings)
        stack.callback(station.end)
        ready = _expect(station, Ready)
        watch = stack.enter_context(closing(Watch(ready.url)))
        _await_warm(watch)
        robots.line.send("go")
        sent = _expect(robots, Sent)
        all_counted = _drained(watch, station, sent.keyframes)
        return _summary(station), all_counted


def _await_warm(watch: Watch) -> None:
    """Loading compiled code belongs to the start."""
    deadline_s = time.monotonic() + _WARM_S
    while not watch.ready():
        if time.monotonic() > deadline_s:
            raise LoadError(f"the station was not ready within {_WARM_S:g} s")
        time.sleep(_POLL_S)


def _expect(child: Child, kind: type[_T]) -> _T:
    match child.line.receive():
        case Failed(text):
            raise LoadError(text)
        case said if isinstance(said, kind):
            return said
    raise LoadError(f"a process ended before it said {kind.__name__}")


def _summary(station: Child) -> Summary:
    station.line.send("summary")
    return _expect(station, Summary)


def _drained(watch: Watch, station: Child, sent: int) -> bool:
    """Wait until nothing is under way; are all keyframes accounted for then?"""
    deadline_s = time.monotonic() + _DRAIN_S
    while True:
        counted = watch.keyframes()
        complete = counted.received + counted.missing == sent
        if (complete and not counted.waiting and not _summary(station).under_way) or time.monotonic() > deadline_s:
            return complete
        time.sleep(_POLL_S)


def free_endpoint() -> str:
    """An end point on this machine that nobody listens on."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
