"""Does anything grow in a station that lives long among rovers that come and go, are killed, pause, and talk garbage?

Runs only when it is named. In the folder COVISTA_SOAK_OUT, if that is set, it leaves what it saw, however it ends:
`soak.json`, `soak.png`, and the station's log. COVISTA_SOAK_MINUTES is how long it takes; trends are judged from 20 on.
"""

from __future__ import annotations

import json
import math
import os
import random
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path

from covista_schemas.errors import CovistaError

from covista_service.bench import load, soak_script
from covista_service.bench.row import Row
from covista_service.bench.soak_accounts import Accounts, accounts_of
from covista_service.bench.soak_books import Books, Sent
from covista_service.bench.soak_judge import LEAST_MIN, Judged, judged, seen_in
from covista_service.bench.soak_plot import Panel, drawn
from covista_service.bench.soak_process import RoverProcess, garble, name_of
from covista_service.bench.soak_station import RETENTION_MB, Look, SoakStation
from covista_service.bench.soak_swarm import SoakSwarm
from covista_service.drawing.plots import need_matplotlib

OUT, MINUTES = "COVISTA_SOAK_OUT", "COVISTA_SOAK_MINUTES"
SHORT_MIN, LONG_MIN = 3.0, 30.0
SEED = 0
ROBOTS, FEATURES = 12, 200
_LOOK_S = 1.0
_DRAIN_S, _POLL_S = 20.0, 0.2
# What is written beyond the limit before the oldest goes, and the database's own log of what is not in its file yet.
_ROOM_MB = 4.0

_row = partial(Row, bench="soak", peer=None, peer_median=None, spread=None)


@dataclass(slots=True, eq=False)
class Soaked:
    """What was seen so far: the station, what happened how often, and in the end the accounts and how it ended.

    `compared` accounts of robots of which no boot was killed are `off` by so many messages. So many `died` unasked.
    """

    looks: list[Look] = field(default_factory=list)
    accounts: Accounts | None = None
    happened: dict[str, int] = field(default_factory=dict)
    compared: int = 0
    off: int = 0
    died: int = 0
    tracebacks: int = 0
    status: int | None = None


def rows(long: bool) -> Iterator[Row]:
    """A row for each thing that must not grow; accounts; and what the log says. Raises LoadError, CovistaError."""
    minutes, out = _asked(LONG_MIN if long else SHORT_MIN)
    if out is not None:
        need_matplotlib()
        out.mkdir(parents=True, exist_ok=True)
    soaked, trends, found = Soaked(), list[Judged](), list[Row]()
    try:
        _soak(soaked, 60 * minutes, out)
        if minutes >= LEAST_MIN:
            trends += judged(seen_in(soaked.looks))
        found += [*(each.row() for each in trends), *_counted(soaked)]
    finally:
        if out is not None:
            _write(out, soaked, trends, found)
    yield from found


def _asked(minutes: float) -> tuple[float, Path | None]:
    """How long, in minutes, and where to."""
    text = os.environ.get(MINUTES, "")
    try:
        minutes = float(text) if text else minutes
    except ValueError:
        minutes = math.nan
    if not 1 <= minutes <= 10_000:
        raise CovistaError(f"{MINUTES} is {text!r}, not a number of minutes from 1 on")
    out = os.environ.get(OUT)
    return minutes, Path(out) if out else None


def _soak(soaked: Soaked, seconds: float, out: Path | None) -> None:
    """Enter into `soaked` what is seen, as it is: it is there also when a part of it fails."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="covista-", ignore_cleanup_errors=True)))
        station = SoakStation(folder, (out or folder) / "station.log")
        stack.callback(station.end)
        station.await_ready()
        stock, chance = load.stock(ROBOTS, FEATURES), random.Random(SEED)
        books = Books(lambda robot: station.heard(name_of(robot)))
        present = soak_script.roster(chance, ROBOTS)
        swarm = SoakSwarm(
            partial(RoverProcess, station.link, stock),
            partial(garble, station.link),
            soak_script.turns(chance, ROBOTS),
            books,
            time.monotonic,
        )
        stack.callback(swarm.end)
        try:
            swarm.gather(present)
            for look in _watched(station, swarm, seconds):
                soaked.looks.append(look)
            _disperse(swarm)
            soaked.accounts = _settled(station, books.sent)
            soaked.status = station.end()
        finally:
            soaked.happened, soaked.died = dict(swarm.happened), swarm.died
            soaked.compared, soaked.off = books.compared, books.off
            soaked.tracebacks = station.log.read_text(errors="replace").count("Traceback")


def _watched(station: SoakStation, swarm: SoakSwarm, seconds: float) -> Iterator[Look]:
    """A look a second while things happen."""
    end_s = time.monotonic() + seconds
    while (now_s := time.monotonic()) < end_s:
        swarm.happen()
        yield station.look()
        time.sleep(max(0.0, now_s + _LOOK_S - time.monotonic()))


def _disperse(swarm: SoakSwarm) -> None:
    while swarm.there:
        swarm.disperse()
        time.sleep(_POLL_S)


def _settled(station: SoakStation, sent: Sent) -> Accounts:
    """The accounts, once they add up or there is no more hope that they will."""
    deadline_s = time.monotonic() + _DRAIN_S
    while True:
        samples = station.samples()
        accounts = accounts_of(samples, sent)
        done = not accounts.unaccounted and not samples["covista_mail_messages"]
        if done or time.monotonic() > deadline_s:
            return accounts
        time.sleep(_POLL_S)


def _counted(soaked: Soaked) -> Iterator[Row]:
    database_mb = max(look.database_mb for look in soaked.looks)
    most_mb = RETENTION_MB + _ROOM_MB
    yield _row(case="database", median=database_mb, unit="MB", mark=f"<= {most_mb:g} MB", holds=database_mb <= most_mb)
    accounts = soaked.accounts
    for case, count, unit in (
        ("unaccounted", accounts.unaccounted if accounts is not None else -1, "messages"),
        ("lost_unkilled", soaked.off, "messages"),
        ("died_unasked", soaked.died, "rovers"),
        ("tracebacks", soaked.tracebacks, "times"),
        ("status", -1 if soaked.status is None else soaked.status, "of the end"),
    ):
        yield _row(case=case, median=count, unit=unit, mark="0", holds=count == 0)
    for case, count, unit in (
        ("received", accounts.received if accounts is not None else 0, "messages"),
        ("compared", soaked.compared, "accounts"),
        ("happened", sum(soaked.happened.values()), "times"),
    ):
        yield _row(case=case, median=count, unit=unit, mark="> 0", holds=count > 0)


def _write(out: Path, soaked: Soaked, trends: Sequence[Judged], found: Sequence[Row]) -> None:
    """All that there is; a soak that broke before it saw anything leaves no more than the log."""
    if not soaked.looks:
        return
    begun_s, seen = soaked.looks[0].at_s, seen_in(soaked.looks)
    told = {
        "rows": [row.as_json() for row in found],
        "accounts": None if soaked.accounts is None else asdict(soaked.accounts),
        "compared": soaked.compared,
        "off": soaked.off,
        "died": soaked.died,
        "happened": soaked.happened,
        "looks": [
            {name: value for name, value in asdict(look).items() if name != "buckets"} | {"at_s": look.at_s - begun_s}
            for look in soaked.looks
        ],
        "latencies_ms": {name: seen[name].points for name in ("p50", "p99")},
    }
    (out / "soak.json").write_text(json.dumps(told, allow_nan=False))
    by_name = {each.name: each for each in trends}
    panels = [Panel(name, each.points, by_name.get(name)) for name, each in seen.items() if each.points]
    panels += [
        Panel(name, [(look.at_s - begun_s, getattr(look, name)) for look in soaked.looks])
        for name in ("database_mb", "robots", "sessions")
    ]
    (out / "soak.png").write_bytes(drawn(panels))
