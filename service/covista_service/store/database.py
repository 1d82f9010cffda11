"""How databases are opened."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from covista_schemas.errors import CovistaError
from sqlalchemy import Engine, create_engine, event
from sqlalchemy.exc import ArgumentError, NoSuchModuleError

# How long a write waits for another process that has the file locked.
_BUSY_MS = 1000


_SETTING = "setting database (--database, COVISTA_DATABASE)"


class DatabaseError(CovistaError):
    """A database URL that no engine can be made of."""


def check_url(url: str) -> None:
    """Refuse what can never work, before anything listens. Raises DatabaseError."""
    open_engine(url).dispose()


def open_engine(url: str) -> Engine:
    """An engine for `url`; nothing is connected yet. Raises DatabaseError."""
    try:
        engine = create_engine(url, pool_pre_ping=True)
    except (ImportError, NoSuchModuleError) as error:
        raise DatabaseError(
            f"{_SETTING}: no driver for it: {error}; PostgreSQL needs pip install 'covista[scale]'"
        ) from error
    except (ArgumentError, TypeError, ValueError) as error:
        raise DatabaseError(f"{_SETTING}: options that make no sense: {error}") from error
    if engine.dialect.name == "sqlite":
        event.listen(engine, "connect", _prepare_sqlite)
    return engine


def file_is_gone(engine: Engine) -> bool:
    """Whether the engine's database is a file of SQLite that is not there, or not any more."""
    url = engine.url
    plain = engine.dialect.name == "sqlite" and url.database and not url.database.startswith(("file:", ":memory:"))
    return bool(plain) and not Path(str(url.database)).exists()


def _prepare_sqlite(connection: Any, _record: object) -> None:
    """Readers and the writer do not block each other, and a crash of the process loses nothing that was committed."""
    cursor = connection.cursor()
    cursor.execute(f"PRAGMA busy_timeout = {_BUSY_MS}")
    cursor.execute("PRAGMA journal_mode = WAL")
    cursor.execute("PRAGMA synchronous = NORMAL")
    cursor.close()
