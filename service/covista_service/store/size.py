"""How much room a database takes, and how that is held."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from sqlalchemy import Engine, func, literal, select, text

from covista_service.store.database import file_of
from covista_service.store.retention import PAST, drop_oldest
from covista_service.store.tables import metadata

# What is left for SQLite's log, which is cut back to 1 MB when it has been written into the file.
_MARGIN_BYTES = 4_000_000
# Pages that are given back at a time.
_PAGES = 256
# How long PostgreSQL may take to make room that rows have left fit for new ones.
_VACUUM_S = 20.0
# Tables of the server are this much shorter after one look, as far as they are too large.
_STEPS = 8


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

    So the oldest go when the tables grow beyond the limit, and again only when they grow further.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._floor_bytes = 0

    def fit(self, limit_bytes: int) -> bool:
        """Take one step towards the limit, if it is exceeded; True if another one is needed."""
        if self._taken() <= max(limit_bytes, self._floor_bytes):
            return False
        removed = False
        for _ in range(_STEPS):
            with self._engine.begin() as connection:
                removed = drop_oldest(connection) or removed
        self._vacuum()
        self._floor_bytes = self._taken()
        return False

    def _taken(self) -> int:
        total = sum((func.pg_total_relation_size(name) for name in metadata.tables), literal(0))
        with self._engine.begin() as connection:
            return int(connection.execute(select(total)).scalar_one())

    def _vacuum(self) -> None:
        with self._engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            driver = connection.connection.driver_connection
            connection.execute(text(f"SET statement_timeout = {round(1000 * _VACUUM_S)}"))
            if isinstance(driver, Patient):
                driver.patience_s = _VACUUM_S
            for table in PAST:
                connection.execute(text(f"VACUUM {table.name}"))
            # Its timeouts are not those of the others.
            connection.invalidate()


def _size_of_log(file: Path | None) -> int:
    try:
        return Path(f"{file}-wal").stat().st_size if file else 0
    except OSError:
        return 0
