"""A test rig: a station under instruments, and a crowd that loads it, as processes of their own."""

from __future__ import annotations

import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from covista_clients.simulation.marching import March
from covista_schemas.errors import CovistaError

from covista_service.bench import instruments, load
from covista_service.bench.instruments import READINGS, WORKLOAD, Readings
from covista_service.bench.load import LoadOptions, Prepared, Sent
from covista_service.config import Settings
from covista_service.demo import children
from covista_service.demo.children import Child
from covista_service.demo.tidings import Failed, Ready
from covista_service.demo.watch import Watch
from covista_service.station.workload import Workload
from covista_service.telemetry import Summary

_DRAIN_S = 5.0
_WARM_S = 120.0
_POLL_S = 0.1
# Looks in a row.
_IDLE = 3
_LIKELY, _SWEEP = ("regular", "moved"), "sweep"
_T = TypeVar("_T")


class LoadError(CovistaError):
    """Station or load did not do their part."""


@dataclass(frozen=True, slots=True)
class Window:
    """What a station did in a stretch of time, `seconds` long, and what was sent to it meanwhile.

    `skipped` messages were too late to be sent. `sweeps` are those of the surveys that were tried once in a while, of
    pairs that are not likely to meet. Latencies run from a keyframe's arrival to the first groups evaluated with a
    survey of it.
    """

    seconds: float
    keyframes: int
    poses: int
    behind_s: float
    surveys: int
    sweeps: int
    cpu_s: float
    regrouping_s: float
    latencies_ms: tuple[float, ...]
    turns_ms: tuple[float, ...]
    skipped: int = 0

    def latency_ms(self, share: float) -> float:
        """The latency that a share of the keyframes does not exceed. Raises LoadError."""
        if not self.latencies_ms:
            raise LoadError("no keyframe came as far as the groups")
        return float(np.quantile(self.latencies_ms, share))

    @property
    def surveyed_per_s(self) -> float:
        """Keyframes a second that came as far as the groups."""
        return len(self.latencies_ms) / self.seconds


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """A station that is warm, and robots that are ready to go."""

    station: Child
    robots: Child
    watch: Watch
    url: str

    def start(self, plan: March) -> None:
        """Let the robots send."""
        self.robots.line.send(plan)

    def sent(self) -> Sent:
        """Wait for the end of what was started."""
        return expect(self.robots, Sent)

    def march(self, plan: March) -> Sent:
        """Let the robots send, and wait for the end of it."""
        self.start(plan)
        return self.sent()

    def readings(self) -> Readings:
        """What the instruments say now."""
        self.station.line.send(READINGS)
        return expect(self.station, Readings)

    def summary(self) -> Summary:
        """What the station has measured of itself so far."""
        self.station.line.send("summary")
        return expect(self.station, Summary)

    def window(self, plan: March, sent: Sent) -> tuple[Window, Sent]:
        """Let the robots send, after all that they have `sent` before, and say what came of it."""
        before = self.readings()
        done = self.march(plan)
        after = self.readings()
        return Window(
            seconds=after.at_s - before.at_s,
            keyframes=done.keyframes - sent.keyframes,
            poses=done.poses - sent.poses,
            behind_s=done.behind_s,
            surveys=after.summary.surveys - before.summary.surveys,
            sweeps=after.workload.started.get(_SWEEP, 0) - before.workload.started.get(_SWEEP, 0),
            cpu_s=after.cpu_s - before.cpu_s,
            regrouping_s=after.regrouping_s - before.regrouping_s,
            latencies_ms=tuple(latency_ms for _, latency_ms in after.latencies_ms),
            turns_ms=after.turns_ms,
            skipped=done.skipped - sent.skipped,
        ), done

    def settle(self, timeout_s: float = _DRAIN_S) -> bool:
        """Wait until for a moment no likely pair waits, and hands are idle; False after `timeout_s`.

        One may be busy: the sweep never ends.
        """
        deadline_s, idle = time.monotonic() + timeout_s, 0
        while idle < _IDLE:
            self.station.line.send(WORKLOAD)
            load = expect(self.station, Workload)
            waiting = sum(load.waiting.get(queue, 0) for queue in _LIKELY)
            idle = 0 if waiting or self.summary().under_way > 1 else idle + 1
            if time.monotonic() > deadline_s:
                return False
            time.sleep(_POLL_S)
        return True

    def accounted(self, sent: Sent) -> bool:
        """Are all keyframes received or missing once nothing waits any more?"""
        deadline_s = time.monotonic() + _DRAIN_S
        while True:
            counted = self.watch.keyframes()
            complete = counted.received + counted.missing == sent.keyframes
            if (complete and not counted.waiting) or time.monotonic() > deadline_s:
                return complete
            time.sleep(_POLL_S)


@contextmanager
def rig(options: LoadOptions) -> Iterator[Rig]:
    """A station on `options.connect`, and its robots. Raises LoadError."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="covista-", ignore_cleanup_errors=True))
        database = f"sqlite:///{folder}/covista.db"
        settings = Settings(api="127.0.0.1:0", link=(options.connect,), database=database, log_level="error")
        robots = children.start(load.__name__, options, load.stock(options.robots, options.features))
        stack.callback(robots.end)
        station = children.start(instruments.__name__, settings)
        stack.callback(station.end)
        expect(robots, Prepared)
        url = expect(station, Ready).url
        watch = stack.enter_context(closing(Watch(url)))
        _await_warm(watch)
        yield Rig(station, robots, watch, url)


def expect(child: Child, kind: type[_T]) -> _T:
    """What a child says next. Raises LoadError if it is something else."""
    match child.line.receive():
        case Failed(text):
            raise LoadError(text)
        case said if isinstance(said, kind):
            return said
    raise LoadError(f"a process ended before it said {kind.__name__}")


def free_endpoint() -> str:
    """An end point on this machine that nobody listens on."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


def _await_warm(watch: Watch) -> None:
    """Loading compiled code belongs to the start."""
    deadline_s = time.monotonic() + _WARM_S
    while not watch.ready():
        if time.monotonic() > deadline_s:
            raise LoadError(f"the station was not ready within {_WARM_S:g} s")
        time.sleep(_POLL_S)
