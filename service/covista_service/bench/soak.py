"""Does anything grow in a station that lives long among rovers that come and go, are killed, pause, and talk garbage?

Runs only when it is named. In the folder COVISTA_SOAK_OUT, if that is set, it leaves what it saw: `soak.json`,
`soak.png`, and the station's log. COVISTA_SOAK_MINUTES is how long it takes.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

from covista_schemas.errors import CovistaError

from covista_service.bench import load
from covista_service.bench.memory import FLAT_SHARE, Trend, trend_of
from covista_service.bench.row import Row
from covista_service.bench.soak_plot import Panel, drawn
from covista_service.bench.soak_station import RETENTION_MB, Look, Samples, SoakStation, quantile_s
from covista_service.bench.soak_swarm import Sent, SoakSwarm
from covista_service.drawing.plots import need_matplotlib

OUT, MINUTES = "COVISTA_SOAK_OUT", "COVISTA_SOAK_MINUTES"
SHORT_MIN, LONG_MIN = 3.0, 30.0
SEED = 0
ROBOTS, FEATURES = 12, 200
_LOOK_S = 1.0
_DRAIN_S, _POLL_S = 20.0, 0.2
# Latencies are of so many seconds each: some dozens of keyframes.
_WINDOW_S = 10.0
# What is written beyond the limit before the oldest goes, and the database's own log of what is not in its file yet.
_ROOM_MB = 4.0

_row = partial(Row, bench="soak", peer=None, peer_median=None)
Series = Sequence[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Accounts:
    """What the station says of all messages when nobody sends any more, and what was sent."""

    received: int
    fates: int
    waiting: int
    missing: int
    duplicate: int
    sent: Sent

    @property
    def unaccounted(self) -> int:
        """Messages with no fate or with two, or beyond the bounds of what was sent."""
        heard = self.received + self.missing - self.duplicate - self.sent.garbage
        beyond = max(0, self.sent.least - heard, heard - self.sent.most)
        return abs(self.received - self.fates - self.waiting) + self.waiting + beyond


@dataclass(frozen=True, slots=True, eq=False)
class Soaked:
    """What was seen: the station some times, its accounts at the end, what happened how often, and how it ended."""

    looks: tuple[Look, ...]
    accounts: Accounts
    happened: dict[str, int]
    tracebacks: int
    status: int | None


def rows(long: bool) -> Iterator[Row]:
    """A row for each thing that must not grow; accounts; and what the log says. Raises LoadError, CovistaError."""
    minutes, out = _asked(LONG_MIN if long else SHORT_MIN)
    if out is not None:
        need_matplotlib()
        out.mkdir(parents=True, exist_ok=True)
    soaked = _soaked(60 * minutes, out)
    series = series_of(soaked.looks)
    found = [*_judged(series), *_counted(soaked)]
    if out is not None:
        _write(out, soaked, series, found)
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


def _soaked(seconds: float, out: Path | None) -> Soaked:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="covista-", ignore_cleanup_errors=True)))
        station = SoakStation(folder)
        stack.callback(station.end)
        station.await_ready()
        swarm = SoakSwarm(station.link, load.stock(ROBOTS, FEATURES), SEED)
        stack.callback(swarm.end)
        swarm.gather()
        looks = tuple(_watched(station, swarm, seconds))
        swarm.disperse()
        accounts = _settled(station, swarm.sent)
        status = station.end()
        log = station.log.read_text(errors="replace")
        if out is not None:
            (out / "station.log").write_text(log)
        return Soaked(looks, accounts, dict(swarm.happened), log.count("Traceback"), status)


def _watched(station: SoakStation, swarm: SoakSwarm, seconds: float) -> Iterator[Look]:
    """A look a second while things happen."""
    end_s = time.monotonic() + seconds
    while (now_s := time.monotonic()) < end_s:
        swarm.happen()
        yield station.look()
        time.sleep(max(0.0, now_s + _LOOK_S - time.monotonic()))


def _settled(station: SoakStation, sent: Sent) -> Accounts:
    """The accounts, once nothing waits any more."""
    deadline_s = time.monotonic() + _DRAIN_S
    while True:
        samples = station.samples()
        accounts = accounts_of(samples, sent)
        if not (accounts.waiting or samples["covista_mail_messages"]) or time.monotonic() > deadline_s:
            return accounts
        time.sleep(_POLL_S)


def accounts_of(samples: Samples, sent: Sent) -> Accounts:
    """What metrics say of all messages of both topics, forgotten robots' included."""

    def total(name: str, word: str = "") -> int:
        found = (value for key, value in samples.items() if key.startswith(f"{name}{{") and word in key)
        return round(sum(found))

    fates = sum(total("covista_messages_total", f"fate={fate},") for fate in ("used", "replaced", "duplicate"))
    return Accounts(
        received=total("covista_messages_total", "fate=received,"),
        fates=fates + total("covista_dropped_total"),
        waiting=total("covista_messages_waiting"),
        missing=total("covista_messages_missing"),
        duplicate=total("covista_messages_total", "fate=duplicate,"),
        sent=sent,
    )


def series_of(looks: Sequence[Look]) -> dict[str, Series]:
    """What must not grow: by name with unit, (s since the first look, value)."""
    begun_s = looks[0].at_s
    values: dict[str, Callable[[Look], float]] = {
        "resident MB": lambda look: look.resident_mb,
        "files": lambda look: look.files,
        "threads": lambda look: look.threads,
        "WAL MB": lambda look: look.wal_mb,
    }
    series: dict[str, Series] = {
        name: [(look.at_s - begun_s, value(look)) for look in looks] for name, value in values.items()
    }
    for share in (0.5, 0.99):
        series[f"p{share * 100:g} ms"] = list(_latencies(looks, share))
    return series


def _latencies(looks: Sequence[Look], share: float) -> Iterator[tuple[float, float]]:
    before = looks[0]
    for look in looks[1:]:
        if look.at_s - before.at_s >= _WINDOW_S:
            value_s = quantile_s(before, look, share)
            if value_s is not None:
                yield (before.at_s + look.at_s) / 2 - looks[0].at_s, 1e3 * value_s
            before = look


def _judged(series: dict[str, Series]) -> Iterator[Row]:
    mark = f"0 within the interval, or <= {100 * FLAT_SHARE:g} % in all"
    for name, points in series.items():
        what, _, unit = name.partition(" ")
        trend = _trend(points)
        yield _row(
            case=what.lower(),
            median=trend.slope,
            spread=trend.margin,
            unit=f"{unit or what}/h",
            mark=mark,
            holds=trend.flat,
        )


def _trend(points: Series) -> Trend:
    """Of what was nothing at first, any growth that can be told from none is too much."""
    trend = trend_of([(at_s, value + 1e-9) for at_s, value in points])
    return trend if math.isfinite(trend.margin) else replace(trend, margin=0.0)


def _counted(soaked: Soaked) -> Iterator[Row]:
    database_mb = max(look.database_mb for look in soaked.looks)
    most_mb = RETENTION_MB + _ROOM_MB
    yield _row(
        case="database",
        median=database_mb,
        spread=None,
        unit="MB",
        mark=f"<= {most_mb:g} MB",
        holds=database_mb <= most_mb,
    )
    for case, count, unit in (
        ("unaccounted", soaked.accounts.unaccounted, "messages"),
        ("tracebacks", soaked.tracebacks, "times"),
        ("status", -1 if soaked.status is None else soaked.status, "of the end"),
    ):
        yield _row(case=case, median=count, spread=None, unit=unit, mark="0", holds=count == 0)
    things = sum(soaked.happened.values())
    yield _row(case="happened", median=things, spread=None, unit="times", mark="> 0", holds=things > 0)


def _write(out: Path, soaked: Soaked, series: dict[str, Series], found: Sequence[Row]) -> None:
    begun_s = soaked.looks[0].at_s
    told = {
        "rows": [row.as_json() for row in found],
        "accounts": asdict(soaked.accounts),
        "happened": soaked.happened,
        "looks": [
            {name: value for name, value in asdict(look).items() if name != "buckets"} | {"at_s": look.at_s - begun_s}
            for look in soaked.looks
        ],
        "latencies_ms": {name: series[name] for name in series if name.endswith(" ms")},
    }
    (out / "soak.json").write_text(json.dumps(told, allow_nan=False))
    panels = [Panel(name, points, _trend(points)) for name, points in series.items()]
    panels += [
        Panel("database MB", [(look.at_s - begun_s, look.database_mb) for look in soaked.looks]),
        Panel("robots known", [(look.at_s - begun_s, look.robots) for look in soaked.looks]),
    ]
    (out / "soak.png").write_bytes(drawn(panels))
