"""What is lost when a station is killed in the middle of its work, and how soon is it back?

Six robots send, somebody changes a setting twice a second and follows the events, and at random moments the station is
killed (SIGKILL) and started again on the same database.
"""

from __future__ import annotations

import random
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import httpx
from covista_clients.simulation.marching import March
from covista_schemas.reports import EventReport, EventsHistory, GroupsReport, PairsReport

from covista_service.bench import load
from covista_service.bench.load import LoadOptions, Prepared
from covista_service.bench.rig import LoadError, expect, free_endpoint
from covista_service.bench.row import Row, median, spread
from covista_service.config import Settings
from covista_service.demo import children, station_role
from covista_service.demo.children import Child
from covista_service.demo.tidings import Ready

MOST_READY_S = 5.0
# What may be lost is what happened so shortly before the kill.
GRACE_S = 1.0
KILLS, LONG_KILLS = 4, 20
_ROBOTS, _FEATURES, _RATE_HZ = 6, 200, 2.0
_LEAST_LIFE_S, _MOST_LIFE_S = 2.0, 6.0
_CHANGE_S, _POLL_S, _TIMEOUT_S = 0.5, 0.05, 60.0
_PAGE = 500

_row = partial(Row, bench="restart", peer=None, peer_median=None)


@dataclass(slots=True)
class Toll:
    """What all kills together cost: seconds until each new station was ready, and what it did not remember."""

    ready_s: list[float] = field(default_factory=list)
    revisions_back: int = 0
    labels_lost: int = 0
    pairs_lost: int = 0
    events_lost: int = 0


def rows(long: bool) -> Iterator[Row]:
    """`restart/ready` of each kill, and how often numbers went back, labels changed, pairs or events were lost."""
    kills = LONG_KILLS if long else KILLS
    toll = killed(kills, random.Random(0))
    worst_s = max(toll.ready_s)
    yield _row(
        case="ready",
        median=median(toll.ready_s),
        spread=spread(toll.ready_s),
        unit="s",
        mark=f"<= {MOST_READY_S:g} s, each of {kills}",
        holds=worst_s <= MOST_READY_S,
    )
    yield _row(case="ready_worst", median=worst_s, spread=None, unit="s", mark="", holds=True)
    for case, count, unit in (
        ("revisions_back", toll.revisions_back, "times"),
        ("labels_lost", toll.labels_lost, "groups"),
        ("pairs_lost", toll.pairs_lost, "pairs"),
        ("events_lost", toll.events_lost, "events"),
    ):
        yield _row(case=case, median=count, spread=None, unit=unit, mark="0", holds=not count)


def killed(kills: int, chance: random.Random) -> Toll:
    """Kill a station so often. Raises LoadError where it does not come back."""
    toll = Toll()
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="covista-", ignore_cleanup_errors=True))
        link = free_endpoint()
        database = f"sqlite:///{folder}/covista.db"
        settings = Settings(api="127.0.0.1:0", link=(link,), database=database, log_level="error")
        robots = children.start(load.__name__, LoadOptions(link, _ROBOTS, _FEATURES))
        stack.callback(robots.end)
        expect(robots, Prepared)
        life = _Life(settings)
        stack.callback(lambda: life.end())
        robots.line.send(March(_RATE_HZ, _RATE_HZ, kills * (_MOST_LIFE_S + 2 * MOST_READY_S) + _TIMEOUT_S))
        life.await_work()
        for _ in range(kills):
            life.last(chance.uniform(_LEAST_LIFE_S, _MOST_LIFE_S))
            left = life.kill()
            life = _Life(settings)
            toll.ready_s.append(life.ready_s)
            _reckon(toll, left, life)
            life.await_work()
    return toll


@dataclass(frozen=True, slots=True)
class _Left:
    """What a station said before it was killed: its groups and pairs some time before, and all events so far."""

    killed_s: float
    groups: GroupsReport
    steady: bool
    pairs: PairsReport
    heard: tuple[EventReport, ...]


class _Life:
    """A station from its start to its end, and those who watch it."""

    def __init__(self, settings: Settings) -> None:
        begun_s = time.monotonic()
        self.station: Child = children.start(station_role.__name__, settings)
        url = expect(self.station, Ready).url
        self.client = httpx.Client(base_url=url, timeout=_TIMEOUT_S)
        self._wait(lambda: self.client.get("/readyz").is_success, "ready")
        self.ready_s = time.monotonic() - begun_s
        self._heard: list[EventReport] = []
        self._ended = threading.Event()
        self._listener = threading.Thread(target=self._listen, args=(url,), name="listener")
        self._listener.start()

    def get(self, path: str, **parameters: Any) -> bytes:
        """An answer. Raises LoadError."""
        answer = self.client.get(f"/api/v1{path}", params=parameters)
        if answer.is_error:
            raise LoadError(f"{path} is answered with {answer.status_code}")
        return answer.content

    def await_work(self) -> None:
        """Wait until robots are grouped and some pairs are known by images."""
        self._wait(self._works, "at work")

    def last(self, seconds: float) -> None:
        """Live on, a setting being changed every now and then."""
        end_s, alpha = time.monotonic() + seconds, 0.5
        while time.monotonic() < end_s:
            alpha = 1.0 - alpha if alpha != 0.5 else 0.49
            if self.client.patch("/api/v1/settings", json={"alpha": alpha}).is_error:
                raise LoadError("the settings cannot be changed")
            time.sleep(_CHANGE_S)

    def kill(self) -> _Left:
        """End it at once; what it had said."""
        pairs = PairsReport.read(self.get("/pairs"))
        groups = GroupsReport.read(self.get("/groups"))
        time.sleep(GRACE_S)
        steady = GroupsReport.read(self.get("/groups")).groups == groups.groups
        killed_s = time.time()
        self.station.process.kill()
        self.end()
        return _Left(killed_s, groups, steady, pairs, tuple(self._heard))

    def end(self) -> None:
        """Let go of it."""
        self._ended.set()
        self.station.end()
        self._listener.join()
        self.client.close()

    def _works(self) -> bool:
        groups, pairs = GroupsReport.read(self.get("/groups")), PairsReport.read(self.get("/pairs"))
        return sum(len(group.robots) for group in groups.groups) == _ROBOTS and any(
            pair.found_by == "image" for pair in pairs.pairs
        )

    def _wait(self, come: Any, what: str) -> None:
        deadline_s = time.monotonic() + _TIMEOUT_S
        while not come():
            if time.monotonic() > deadline_s:
                raise LoadError(f"the station is not {what} within {_TIMEOUT_S:g} s")
            time.sleep(_POLL_S)

    def _listen(self, url: str) -> None:
        try:
            with (
                httpx.Client(base_url=url, timeout=_TIMEOUT_S) as client,
                client.stream("GET", "/api/v1/events") as answer,
            ):
                for line in answer.iter_lines():
                    if line.startswith("data:") and '"event"' in line:
                        self._heard.append(EventReport.read(line.removeprefix("data:")))
                    if self._ended.is_set():
                        return
        except httpx.HTTPError:
            return


def _reckon(toll: Toll, left: _Left, life: _Life) -> None:
    """Hold the new station against what the old one had said."""
    groups, pairs = GroupsReport.read(life.get("/groups")), PairsReport.read(life.get("/pairs"))
    toll.revisions_back += groups.revision <= left.groups.revision
    if left.steady:
        stand = {group.label: group.robots for group in groups.groups}
        toll.labels_lost += sum(stand.get(group.label) != group.robots for group in left.groups.groups)
    before = [event for event in left.heard if event.time.timestamp() < left.killed_s - GRACE_S]
    shared = [pair for pair in left.pairs.pairs if pair.overlap_a]
    if not before or not shared or not left.groups.groups:
        raise LoadError("a station was killed that had nothing to remember")
    known = {(pair.a, pair.b) for pair in pairs.pairs if pair.overlap_a is not None}
    toll.pairs_lost += sum((each.a, each.b) not in known for each in shared)
    kept = {event.id for event in _events(life)}
    toll.events_lost += sum(event.id not in kept for event in before)


def _events(life: _Life) -> Iterator[EventReport]:
    cursor: str | None = None
    while True:
        page = EventsHistory.read(
            life.get("/events/history", limit=_PAGE, **({} if cursor is None else {"cursor": cursor}))
        )
        yield from page.items
        cursor = page.next
        if cursor is None:
            return
