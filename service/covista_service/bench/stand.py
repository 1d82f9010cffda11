"""A station, and robots that load it, as processes on this machine."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from covista_service.bench import load
from covista_service.bench.latency import LoadError
from covista_service.bench.load import LoadOptions, Prepared, Sent
from covista_service.config import Settings
from covista_service.demo import children
from covista_service.demo.children import Child
from covista_service.demo.run import STATION
from covista_service.demo.tidings import Failed, Ready
from covista_service.demo.watch import Watch
from covista_service.telemetry import Summary

_WARM_S = 120.0
_DRAIN_S = 5.0
_POLL_S = 0.1
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """A station that is warm, and robots that are ready to go."""

    station: Child
    robots: Child
    watch: Watch

    def go(self) -> None:
        """Let the robots send."""
        self.robots.line.send("go")

    def sent(self) -> int:
        """Wait until the robots have sent their last keyframe, and say how many they were."""
        return expect(self.robots, Sent).keyframes

    def summary(self) -> Summary:
        """What the station has measured of itself so far."""
        self.station.line.send("summary")
        return expect(self.station, Summary)

    def cpu_s(self) -> float | None:
        """Seconds of processor time that the station has taken so far; None where the system does not say."""
        try:
            text = Path(f"/proc/{self.station.process.pid}/stat").read_text("ascii")
        except OSError:
            return None
        # Behind the name in brackets: user and system time, in ticks.
        user, system = text.rpartition(")")[2].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")

    def settle(self) -> None:
        """Wait until nothing is under way, for some seconds at most."""
        deadline_s = time.monotonic() + _DRAIN_S
        while self.summary().under_way and time.monotonic() < deadline_s:
            time.sleep(_POLL_S)


@contextmanager
def standing(options: LoadOptions) -> Iterator[Stand]:
    """A station on `options.connect`, and its robots. Raises LoadError."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="covista-", ignore_cleanup_errors=True))
        database = f"sqlite:///{folder}/covista.db"
        settings = Settings(api="127.0.0.1:0", link=(options.connect,), database=database, log_level="warning")
        robots = children.start(load.__name__, options)
        stack.callback(robots.end)
        expect(robots, Prepared)
        station = children.start(STATION, settings)
        stack.callback(station.end)
        watch = stack.enter_context(closing(Watch(expect(station, Ready).url)))
        _await_warm(watch)
        yield Stand(station, robots, watch)


def expect(child: Child, kind: type[_T]) -> _T:
    """What a child says next. Raises LoadError if it is something else."""
    match child.line.receive():
        case Failed(text):
            raise LoadError(text)
        case said if isinstance(said, kind):
            return said
    raise LoadError(f"a process ended before it said {kind.__name__}")


def _await_warm(watch: Watch) -> None:
    deadline_s = time.monotonic() + _WARM_S
    while not watch.ready():
        if time.monotonic() > deadline_s:
            raise LoadError(f"the station was not ready within {_WARM_S:g} s")
        time.sleep(_POLL_S)
