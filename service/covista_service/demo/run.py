"""The demo from the first process to the last: start, watch, judge, drain, report, end."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass
from datetime import UTC, datetime

from covista_clients.simulation import swarm
from covista_clients.simulation.swarm import KeyframeRecord, SwarmOptions
from covista_schemas.errors import CovistaError
from covista_schemas.reports import Group

from covista_service.config import Settings
from covista_service.dashboard.places import PAGES, has_pages
from covista_service.demo import children
from covista_service.demo.accuracy import Accuracy, rendered_overlap
from covista_service.demo.children import Child
from covista_service.demo.groups import GroupsFeed
from covista_service.demo.interruption import Interruption, listening
from covista_service.demo.report import DemoReport, Latency, Members
from covista_service.demo.tidings import Failed, Ready
from covista_service.demo.watch import Watch
from covista_service.telemetry import Summary

STATION, SWARM = "covista_service.demo.station_role", "covista_service.demo.swarm_role"
# The first answers come while the swarm is still assembling; they say little of how good the station is.
JUDGED_AFTER_S = 10.0
POLL_S = 1.0
START_S = 90.0
DRAIN_S = 5.0
_DRAIN_POLL_S = 0.1
_NOTHING_YET = Summary(0, 0, None, None, 0, 0, {})


class DemoError(CovistaError):
    """The demo cannot go on: a part of it did not start, or ended by itself."""


@dataclass(frozen=True, slots=True)
class Screen:
    """Where a demo tells what happens: `line` for what stays, `progress` for what the next one replaces."""

    line: Callable[[str], None]
    progress: Callable[[str], None]


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """What to show: without `seconds` until a signal comes; `report` says whether somebody wants to read one."""

    swarm: SwarmOptions
    settings: Settings
    seconds: float | None = None
    report: bool = False


def run(options: DemoOptions, screen: Screen) -> DemoReport | None:
    """Run a demo in the main thread; the report, None if nobody wants one. Raises DemoError."""
    with listening() as signals, ExitStack() as stack:
        station = children.start(STATION, options.settings)
        stack.callback(station.end)
        ready = _ready(station, signals)
        if ready is None:
            return None
        screen.line(f"API      {ready.url}/api/v1/groups")
        screen.line(f"docs     {ready.url}/docs")
        if has_pages():
            screen.line(f"pages    {ready.url}{PAGES.prefix}/")
        screen.line(f"zenoh    {', '.join(ready.link)}")
        watch = stack.enter_context(closing(Watch(ready.url)))
        _warmed(watch, signals, screen)
        swarm = children.start(SWARM, options.swarm)
        stack.callback(swarm.end)
        feed = stack.enter_context(GroupsFeed(ready.link[0], options.swarm.site))
        demo = Demo(station, swarm, watch, feed, _accuracy(options.swarm), signals, screen)
        demo.show(options.seconds)
        if not options.report:
            return None
        demo.drain()
        return demo.report(options.swarm.robots)


def _ready(station: Child, signals: Interruption) -> Ready | None:
    """Wait until the station listens; None if a signal comes before."""
    if not signals.wait([station.line.connection], START_S):
        if signals.count:
            return None
        raise DemoError(f"the station does not start within {START_S:g} s")
    match station.line.receive():
        case Ready() as ready:
            return ready
        case Failed(text):
            raise DemoError(text)
    raise DemoError("the station ended while it was starting")


def _warmed(watch: Watch, signals: Interruption, screen: Screen) -> None:
    """Wait until the station has loaded what is compiled, and for as long as that may take where it is not yet."""
    end_s = time.monotonic() + START_S
    while not signals.count and time.monotonic() < end_s and not watch.ready():
        screen.progress("loading what is compiled; the first time it is compiled, which takes a minute")
        signals.wait([], POLL_S / 4)


def _accuracy(options: SwarmOptions) -> Accuracy:
    built = swarm.swarm(options)
    index = {name: k for k, name in enumerate(swarm.names(options))}
    return Accuracy(rendered_overlap(built.world, built.camera), lambda robot, t_s: built.paths.pose(index[robot], t_s))


class Demo:
    """A demo under way."""

    def __init__(
        self,
        station: Child,
        swarm: Child,
        watch: Watch,
        feed: GroupsFeed,
        accuracy: Accuracy,
        signals: Interruption,
        screen: Screen,
    ) -> None:
        self._station = station
        self._swarm = swarm
        self._watch = watch
        self._feed = feed
        self._accuracy = accuracy
        self._signals = signals
        self._screen = screen
        self._started_s = time.monotonic()
        self._started = datetime.now(UTC)
        self._last: dict[str, int] = {}
        self._received = 0
        self._summary = _NOTHING_YET
        self._shown: list[Group] = []
        self._changes = 0

    def show(self, seconds: float | None) -> None:
        """Watch, and tell of what happens, until the time is over or a signal comes."""
        end_s = self._started_s + (seconds if seconds is not None else float("inf"))
        look_s = self._started_s
        while not self._signals.count and time.monotonic() < end_s:
            self._hear(min(look_s, end_s) - time.monotonic())
            if time.monotonic() >= look_s:
                self._look()
                look_s = max(look_s + POLL_S, time.monotonic())

    def drain(self) -> None:
        """Let the rovers fall silent, and the station take up what is under way; another signal cuts this short."""
        self._swarm.line.send("quiet")
        signals, deadline_s = self._signals.count, time.monotonic() + DRAIN_S
        before = -1
        while self._signals.count == signals and time.monotonic() < deadline_s:
            self._station.line.send("summary")
            self._hear(_DRAIN_POLL_S)
            counted = self._watch.keyframes()
            self._received = counted.received
            settled = counted.received + counted.missing >= self._sent == before and not counted.waiting
            if settled and not self._summary.under_way:
                break
            before = self._sent
        self._tell_changes()

    def report(self, robots: int) -> DemoReport:
        """What the run came to."""
        return DemoReport(
            robots=robots,
            keyframes_sent=self._sent,
            keyframes_received=self._received,
            surveys=self._summary.surveys,
            q_mae=self._accuracy.error.value,
            q_mae_seen=self._accuracy.error_seen.value,
            latency_ms=Latency(self._summary.latency_p50_ms, self._summary.latency_p99_ms),
            groups=tuple(Members(group.label, tuple(group.robots)) for group in self._watch.groups().groups),
            group_changes=self._changes,
        )

    def _hear(self, timeout_s: float) -> None:
        """Take in what the children say within some time."""
        talkers = {child.line.connection: child for child in (self._station, self._swarm)}
        for connection in self._signals.wait(list(talkers), timeout_s):
            match talkers[connection].line.receive():
                case KeyframeRecord() as record:
                    # Numbers have no gaps, and one that was replaced before it went out gave its own away.
                    self._last[record.robot] = record.sequence
                    self._accuracy.sent(record.robot, record.boot, record.sequence, record.pose, record.t_s)
                case Summary() as summary:
                    self._summary = summary
                case _:
                    who = "station" if talkers[connection] is self._station else "swarm"
                    raise DemoError(f"the {who} ended by itself")

    def _look(self) -> None:
        """Ask the station as mission control would, judge its answers, and tell how things stand."""
        self._station.line.send("summary")
        self._tell_changes()
        self._received = self._watch.keyframes().received
        if self._elapsed_s() >= JUDGED_AFTER_S:
            for pair in self._watch.pairs().pairs:
                self._accuracy.judge(pair)
        self._screen.progress(self._progress())

    def _tell_changes(self) -> None:
        for groups in self._feed.news():
            # A revision may also concern robots without a group only.
            if groups.groups != self._shown:
                self._shown = groups.groups
                self._changes += 1
                names = "  ".join(f"{group.label}: {' '.join(group.robots)}" for group in groups.groups)
                after_s = (groups.time - self._started).total_seconds()
                self._screen.line(f"{after_s:6.1f} s  {names or 'no groups'}")

    def _progress(self) -> str:
        summary, error = self._summary, self._accuracy.error.value
        parts = [f"{self._elapsed_s():.0f} s", f"{self._received} keyframes", f"{summary.surveys} surveys"]
        if summary.latency_p50_ms is not None:
            parts.append(f"{summary.latency_p50_ms:.0f} ms from keyframe to groups")
        if error is not None:
            parts.append(f"mean error of the overlap {error:.3f}")
        return ", ".join(parts)

    @property
    def _sent(self) -> int:
        return sum(last + 1 for last in self._last.values())

    def _elapsed_s(self) -> float:
        return time.monotonic() - self._started_s
