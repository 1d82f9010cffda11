"""How much room a database takes, and how that is held."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable
from math import inf
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from sqlalchemy import Engine, Table, func, literal, select, text

from covista_service.store.database import UNUSABLE, file_of, first_line
from covista_service.store.retention import PAST, drop_oldest
from covista_service.store.tables import metadata
from covista_service.telemetry import about

# What is left for SQLite's log, which is cut back to 1 MB when it has been written into the file.
_MARGIN_BYTES = 4_000_000
# Pages that are given back at a time.
_PAGES = 256
# How long PostgreSQL may take to make room that rows have left fit for new ones.
_VACUUM_S = 20.0
# A table that could not be vacuumed is tried again after so long.
_AGAIN_S = 60.0
# Tables of the server are this much shorter after one look, as far as they are too large.
_STEPS = 8

log = logging.getLogger(__name__)


@runtime_checkable
class Patient(Protocol):
    """A connection of which it can be said how long it may take to answer."""

    patience_s: float


class Size(Protocol):
    """Holds the size of a database."""

    def fit(self, limit_bytes: int) -> bool:
        """Take one step towards the limit, if it is exceeded; True if another one is needed."""


def size_of(engine: Engine) -> Size:
    """For the kind of database that it is."""
    return FileSize(engine) if engine.dialect.name == "sqlite" else ServerSize(engine)


class FileSize:
    """SQLite: the file and its log. Pages that are empty are given back from the end of the file."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._file = file_of(engine.url)

    def fit(self, limit_bytes: int) -> bool:
        """Take one step towards the limit, if it is exceeded; True if another one is needed."""
        margin = max(_size_of_log(self._file), min(_MARGIN_BYTES, limit_bytes // 4))
        with self._engine.begin() as connection:

            def ask(name: str) -> int:
                return int(connection.exec_driver_sql(f"PRAGMA {name}").scalar() or 0)

            pages, most = ask("page_count"), max(0, limit_bytes - margin) // ask("page_size")
            if pages <= most:
                return False
            removed = pages - ask("freelist_count") > most and drop_oldest(connection)
            free = ask("freelist_count")
            driver: Any = connection.connection.driver_connection
            # A page a row, though the rows have no columns: they must be fetched.
            driver.execute(f"PRAGMA incremental_vacuum({min(_PAGES, free, pages - most)})").fetchall()
            return removed or ask("freelist_count") < free


class ServerSize:
    """PostgreSQL: the tables with their indexes. Room that rows have left is used again, but seldom given back.

    So the oldest go when the tables grow beyond the limit, and again only when they grow further. Rows that went leave
    no room before a table is vacuumed, which is done to one table at a look: until all are, nothing else goes.
    """

    def __init__(self, engine: Engine, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._engine = engine
        self._clock_s = clock_s
        self._floor_bytes = 0
        self._due: list[Table] = []
        self._again_s = -inf

    def fit(self, limit_bytes: int) -> bool:
        """Take one step towards the limit, if it is exceeded; True if another one is needed."""
        if self._due:
            if self._clock_s() < self._again_s:
                return False
        else:
            taken = self._taken()
            if taken <= max(limit_bytes, self._floor_bytes):
                return False
            # Whatever comes of the steps: they are not taken again before it grows further.
            self._floor_bytes = taken
            self._shorten()
        if self._vacuum(self._due[-1]):
            self._due.pop()
        else:
            self._again_s = self._clock_s() + _AGAIN_S
        self._floor_bytes = self._taken()
        return False

    def _shorten(self) -> None:
        # The largest comes last, and is vacuumed first.
        self._due = sorted(PAST, key=lambda table: self._taken([table.name]))
        for _ in range(_STEPS):
            with self._engine.begin() as connection:
                if not drop_oldest(connection):
                    return

    def _taken(self, names: Iterable[str] = tuple(metadata.tables)) -> int:
        total = sum((func.pg_total_relation_size(name) for name in names), literal(0))
        with self._engine.begin() as connection:
            return int(connection.execute(select(total)).scalar_one())

    def _vacuum(self, table: Table) -> bool:
        """Make the room fit for new rows; False if that fails, or takes too long."""
        try:
            with self._engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
                driver = connection.connection.driver_connection
                try:
                    connection.execute(text(f"SET statement_timeout = {round(1000 * _VACUUM_S)}"))
                    if isinstance(driver, Patient):
                        driver.patience_s = _VACUUM_S
                    connection.execute(text(f"VACUUM {table.name}"))
                finally:
                    # Its timeouts are not those of the others.
                    connection.invalidate()
        except UNUSABLE as error:
            log.warning("a table cannot be vacuumed", extra=about(table=table.name, said=first_line(error)))
            return False
        return True


def _size_of_log(file: Path | None) -> int:
    try:
        return Path(f"{file}-wal").stat().st_size if file else 0
    except OSError:
        return 0
