"""How soon is the past told? Thirty days of twenty robots, generated in the density that the station stores at least.

Every robot and every pair that has something in common is stored once a minute, a revision of the groups and three
events come every minute, and a client asks a station over REST for moments and pages anywhere in that time.
"""

from __future__ import annotations

import random
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from datetime import UTC, datetime, timedelta
from functools import partial
from itertools import combinations, islice

import httpx
from covista_schemas.reports import EventKind, EventReport, FoundBy, Group, GroupsReport, LiveSettings, Score

from covista_service.bench.rig import LoadError, expect, free_endpoint
from covista_service.bench.row import Row, median, quantile, spread
from covista_service.config import Settings
from covista_service.demo import children, station_role
from covista_service.demo.tidings import Ready
from covista_service.demo.watch import Watch
from covista_service.store.database import open_engine
from covista_service.store.migrations import upgrade
from covista_service.store.rows import Entry, PairEntry, TrackEntry, write

MOST_MS = 20.0
ROBOTS, PAIRS = 20, 60
DAYS, LONG_DAYS = 3, 30
_ASKED, _PAGE = 100, 100
_EVERY = timedelta(minutes=1)
_EVENTS = 3
_BATCH = 200
_START_S, _POLL_S = 120.0, 0.1
# More than is generated, so that nothing of it goes.
_MOST_MB = 4096
_NAMES = [f"r{number}" for number in range(1, ROBOTS + 1)]
_PARTNERS = [tuple(sorted(pair)) for pair in islice(combinations(_NAMES, 2), PAIRS)]

_row = partial(Row, bench="history", unit="ms", mark=f"median <= {MOST_MS:g} ms")


def rows(long: bool) -> Iterator[Row]:
    """`history/groups_at` and a page of revisions, events, a pair's overlaps and a robot's track; peer: their p99."""
    days = LONG_DAYS if long else DAYS
    chance = random.Random(0)
    for case, times_ms in told_ms(days, chance).items():
        yield _row(
            case=case,
            median=median(times_ms),
            spread=spread(times_ms),
            peer=f"p99 of {_ASKED}, {days} days",
            peer_median=quantile(times_ms, 0.99),
            holds=median(times_ms) <= MOST_MS,
        )


def told_ms(days: float, chance: random.Random, asked_times: int = _ASKED) -> dict[str, list[float]]:
    """How long each of the answers took, by what was asked. Raises LoadError."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="covista-", ignore_cleanup_errors=True))
        database = f"sqlite:///{folder}/covista.db"
        since = datetime.now(UTC) - timedelta(days=days)
        fill(database, since, days, chance)
        settings = Settings(
            api="127.0.0.1:0",
            link=(free_endpoint(),),
            database=database,
            retention_days=days + 1,
            retention_mb=_MOST_MB,
            log_level="error",
        )
        station = children.start(station_role.__name__, settings)
        stack.callback(station.end)
        url = expect(station, Ready).url
        _await(stack.enter_context(closing(Watch(url))))
        client = stack.enter_context(httpx.Client(base_url=f"{url}/api/v1", timeout=10.0))

        def moment() -> str:
            return (since + timedelta(days=days * chance.random())).isoformat()

        asked: dict[str, Callable[[], tuple[str, dict[str, str | int]]]] = {
            "groups_at": lambda: ("/groups/at", {"time": moment()}),
            "groups_page": lambda: ("/groups/history", {"from": moment(), "limit": _PAGE}),
            "events_page": lambda: ("/events/history", {"from": moment(), "limit": _PAGE}),
            "pair_page": lambda: ("/pairs/r1/r2/history", {"from": moment(), "limit": _PAGE}),
            "track_page": lambda: ("/robots/r1/track", {"from": moment(), "limit": _PAGE}),
        }
        return {case: [_ask_ms(client, *question()) for _ in range(asked_times)] for case, question in asked.items()}


def fill(database: str, since: datetime, days: float, chance: random.Random) -> None:
    """Write the history of so many days, oldest first."""
    engine = open_engine(database)
    try:
        with engine.begin() as connection:
            upgrade(connection)
        minutes = range(int(timedelta(days=days) / _EVERY))
        for first in minutes[::_BATCH]:
            entries = [entry for minute in minutes[first : first + _BATCH] for entry in _minute(since, minute, chance)]
            with engine.begin() as connection:
                write(connection, entries)
    finally:
        engine.dispose()


def _minute(since: datetime, minute: int, chance: random.Random) -> Iterator[Entry]:
    moment = since + minute * _EVERY
    time_us = round(moment.timestamp() * 1e6)
    for robot in _NAMES:
        yield TrackEntry(robot, time_us, (chance.uniform(-9, 9), chance.uniform(-9, 9), 0.5, 0.0, 0.0, 0.0, 1.0))
    for a, b in _PARTNERS:
        yield PairEntry(a, b, time_us, chance.random(), chance.random(), FoundBy.IMAGE)
    cut = chance.randrange(1, ROBOTS)
    members = (_NAMES[:cut], _NAMES[cut:])
    yield GroupsReport(
        revision=minute + 1,
        time=moment,
        groups=[Group(label=f"g{number}", robots=robots) for number, robots in enumerate(members, 1)],
        ungrouped=[],
        criterion="adaptive",
        scores=[Score(groups=number, score=chance.random()) for number in range(1, 9)],
        settings=LiveSettings(),
    )
    for number in range(_EVENTS):
        yield EventReport(
            id=_EVENTS * minute + number + 1,
            event=EventKind.MOVED,
            time=moment,
            robots=[_NAMES[cut]],
            labels=["g1", "g2"],
            revision_before=minute,
            revision_after=minute + 1,
            text=f"{_NAMES[cut]} moved from g1 to g2",
        )


def _await(watch: Watch) -> None:
    """Wait until the station does nothing else any more. Raises LoadError."""
    deadline_s = time.monotonic() + _START_S
    while not watch.ready():
        if time.monotonic() > deadline_s:
            raise LoadError(f"the station is not ready within {_START_S:g} s")
        time.sleep(_POLL_S)


def _ask_ms(client: httpx.Client, path: str, query: dict[str, str | int]) -> float:
    begun_s = time.perf_counter()
    answer = client.get(path, params=query)
    taken_ms = 1e3 * (time.perf_counter() - begun_s)
    if answer.status_code != 200:
        raise LoadError(f"{path} answers {answer.status_code}: {answer.text[:200]}")
    return taken_ms
