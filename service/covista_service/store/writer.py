"""Writes the history, what is to be remembered, and the numbers in use; for one thread, and all of it may raise."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from covista_schemas.reports import LiveSettings
from sqlalchemy import Connection, Engine, func, insert, select

from covista_service.station.memory import Memory
from covista_service.station.snapshot import Snapshot
from covista_service.store.backlog import Loss
from covista_service.store.database import file_is_gone, open_engine, prepare_file, stamp_of
from covista_service.store.migrations import upgrade
from covista_service.store.moments import within
from covista_service.store.numbers import LastNumbers, ahead, last_used, reserve
from covista_service.store.present import Present
from covista_service.store.recollection import recollect
from covista_service.store.retention import Retention, drop_older, drop_superseded, newest_changes, patch_of
from covista_service.store.rows import Entry, SettingsChange, time_us_of, write
from covista_service.store.size import size_of
from covista_service.store.tables import events, gaps, group_revisions, settings_changes
from covista_service.telemetry import about

_NS_PER_S = 1_000_000_000
# A turn of removing what is too old, or too much, ends after so long.
_TIDY_S = 0.05
_OLD_EVERY_S = 30.0
_SIZE_EVERY_S = 1.0
REMOVED = "the database's file was removed, and all before with it"

log = logging.getLogger(__name__)


class Writer:
    """One database, that may come and go: then it raises one of `database.UNUSABLE`."""

    def __init__(self, url: str, retention: Retention, clock: Callable[[], int] = time.time_ns) -> None:
        self._engine: Engine = open_engine(url)
        self._retention = retention
        self._clock = clock
        self._size = size_of(self._engine)
        self._present = Present()
        self._open = self.continues = self._is_late = False
        self._begun_us: int | None = None
        self._removed: Loss | None = None
        self._stamp: tuple[int, int] | None = None
        self._reserved = self._used = LastNumbers()
        self._patch: dict[str, object] = {}
        self._settings: LiveSettings | None = None
        self._old_s = self._size_s = 0.0

    def start(self) -> LastNumbers:
        """Open the database and go on where it ends: the numbers up to which any may have been used."""
        with self._opening() as last:
            self._used = last
        self.continues = True
        return self._used

    def open(self) -> None:
        """Bring the database up to date, and reserve numbers above those in use."""
        with self._opening() as last:
            strange = not self.continues and not self._is_late and last.over(self._used) != self._used
        if strange:
            # What was told with our numbers is told; those from another state stay beside them.
            log.warning(
                "the database was away when the station started: revisions, events and labels stand in it twice",
                extra=about(revision=last.revision, event=last.event, label=last.label),
            )
        self._is_late = not self.continues

    def write(self, batch: Sequence[Entry], loss: Loss | None, reason: str, used: LastNumbers) -> None:
        """Append entries, and a gap for what is missing; numbers up to `used` are."""
        self._reopen()
        used = used.over(self._used)
        reserved = ahead(self._reserved, used)
        with self._engine.begin() as connection:
            write(connection, batch)
            if loss is not None:
                _mark(connection, loss, reason)
            if reserved != self._reserved:
                reserve(connection, reserved)
        self._used, self._reserved = used, reserved
        for entry in batch:
            if isinstance(entry, SettingsChange):
                self._patch |= entry.patch
                self._settings = entry.settings
        if self._begun_us is None and batch:
            self._begun_us = min(map(time_us_of, batch))

    def remember(self, snapshot: Snapshot) -> None:
        """Keep the state of robots and pairs for a station that starts."""
        self._reopen()
        try:
            with self._engine.begin() as connection:
                self._present.write(connection, snapshot)
        except Exception:
            self._present.forget()
            raise

    def tidy(self) -> bool:
        """Remove some of what is too old or too much, if it is time to look; True if there is more."""
        now_s = time.monotonic()
        more = False
        if self._open and now_s - self._old_s >= _OLD_EVERY_S:
            cutoff_us = within(self._clock() // 1000 - self._retention.span_us)
            more = self._repeat(lambda: self._drop_older(cutoff_us))
            self._old_s = self._old_s if more else now_s
        if self._open and now_s - self._size_s >= _SIZE_EVERY_S:
            larger = self._repeat(lambda: self._size.fit(self._retention.limit_bytes))
            self._size_s = self._size_s if larger else now_s
            more = more or larger
        return more

    def recall(self, forget_after_s: float, unknown_after_s: float) -> Memory:
        """What is remembered: robots and pairs that are not too old."""
        now_ns = self._clock()
        robots_ns, pairs_ns = (now_ns - round(span_s * _NS_PER_S) for span_s in (forget_after_s, unknown_after_s))
        with self._engine.begin() as connection:
            return recollect(connection, self._used, robots_ns, pairs_ns)

    @property
    def patch(self) -> Mapping[str, object]:
        """The last value of every live setting that was given."""
        return dict(self._patch)

    def end(self) -> None:
        """Give back numbers that were not used: nobody will use them."""
        if self._open and self.continues and not file_is_gone(self._engine):
            with self._engine.begin() as connection:
                reserve(connection, self._used)

    def fail(self) -> None:
        """After an error: open it again before anything else is written."""
        self._open = False

    def dispose(self) -> None:
        """Let go of connections."""
        self._engine.dispose()

    def _reopen(self) -> None:
        # Whoever looks at a database whose file is gone makes an empty one: so it is gone too if it is another.
        if file_is_gone(self._engine) or (self._stamp is not None and stamp_of(self._engine) != self._stamp):
            if self._begun_us is not None and self._removed is None:
                self._removed = Loss(self._begun_us, self._clock() // 1000, 0)
                log.warning(
                    "the database's file is gone; a new one is made", extra=about(file=self._engine.url.database)
                )
            self._engine.dispose()
            self._open = False
        if not self._open:
            self.open()

    @contextmanager
    def _opening(self) -> Iterator[LastNumbers]:
        """Whoever opens learns up to where numbers may have been used, and may use others than before."""
        prepare_file(self._engine)
        with self._engine.begin() as connection:
            upgrade(connection)
            last = last_used(connection)
            yield last
            reserved = ahead(last.over(self._reserved), self._used)
            reserve(connection, reserved)
            begun_us = _begun_us(connection)
            if begun_us is not None:
                # A file that was put in the place of the other has a past of its own.
                self._removed = None
            self._restore(connection)
        self._stamp = stamp_of(self._engine)
        self._reserved, self._removed, self._begun_us, self._open = reserved, None, begun_us, True
        self._present.forget()

    def _restore(self, connection: Connection) -> None:
        """In the place of a file that was removed: that it was is a gap, and the settings given are written again."""
        if self._removed is None:
            self._patch = _patch(connection)
            return
        _mark(connection, self._removed, REMOVED)
        if self._patch:
            settings = "{}" if self._settings is None else self._settings.model_dump_json()
            row = {"time_us": self._removed.until_us, "patch": json.dumps(self._patch), "settings": settings}
            connection.execute(insert(settings_changes), row)

    def _drop_older(self, cutoff_us: int) -> bool:
        with self._engine.begin() as connection:
            more = drop_older(connection, cutoff_us)
            # Of settings in its turn: a step ends within milliseconds.
            return more or drop_superseded(connection, cutoff_us)

    def _repeat(self, step: Callable[[], bool]) -> bool:
        """Take steps until there is nothing to do, or it takes too long; True if there is more."""
        end_s = time.monotonic() + _TIDY_S
        while step():
            if time.monotonic() > end_s:
                return True
        return False


def _patch(connection: Connection) -> dict[str, object]:
    oldest_first = reversed(newest_changes(connection))
    return {name: value for _, _, patch in oldest_first for name, value in patch_of(patch).items()}


def _begun_us(connection: Connection) -> int | None:
    """When the oldest entry is of."""
    begun = [connection.execute(select(func.min(table.c.time_us))).scalar() for table in (group_revisions, events)]
    return min((each for each in begun if each is not None), default=None)


def _mark(connection: Connection, loss: Loss, reason: str) -> None:
    connection.execute(
        insert(gaps),
        {"since_us": loss.since_us, "until_us": loss.until_us, "lost": loss.lost, "reason": reason},
    )
