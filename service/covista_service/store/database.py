"""How databases are opened: nobody waits for one for longer than seconds."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Any

from covista_schemas.errors import CovistaError
from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import (
    ArgumentError,
    DataError,
    DBAPIError,
    DisconnectionError,
    IntegrityError,
    NoSuchModuleError,
    SQLAlchemyError,
    StatementError,
)

# How long a statement waits for another process that has the file, or the table, locked.
WAIT_S = 1.0
# A server that says nothing for so long is given up.
SILENCE_S = 4.0
CONNECT_S = 3

_SETTING = "setting database (--database, COVISTA_DATABASE)"
# A file of SQLite is cut back to this when it has been written into the database, which is done every so many pages.
_LOG_BYTES = 1 << 20
_LOG_PAGES = 256
# What can be written anew in a second.
_SMALL_BYTES = 50_000_000


class DatabaseError(CovistaError):
    """A database that cannot be used as it is: its URL, or its schema."""


def check_url(url: str) -> None:
    """Refuse what can never work, before anything listens. Raises DatabaseError."""
    open_engine(url).dispose()


def open_engine(url: str, *, reads: bool = False) -> Engine:
    """An engine for `url`, which `reads` only or writes; nothing is connected yet. Raises DatabaseError."""
    try:
        if make_url(url).get_backend_name() == "sqlite" and make_url(url).database in (None, "", ":memory:"):
            raise DatabaseError(f"{_SETTING}: what is in memory is gone with the station: name a file, or a server")
        engine = create_engine(url, pool_pre_ping=True, pool_timeout=WAIT_S)
    except (ImportError, NoSuchModuleError) as error:
        raise DatabaseError(
            f"{_SETTING}: no driver for it: {error}; PostgreSQL needs pip install 'covista[scale]'"
        ) from error
    except (ArgumentError, TypeError, ValueError) as error:
        raise DatabaseError(f"{_SETTING}: options that make no sense: {error}") from error
    if engine.dialect.name == "sqlite":
        _prepare_sqlite(engine, reads=reads)
    elif engine.dialect.driver == "psycopg":
        _prepare_postgresql(engine, reads=reads)
    return engine


def file_of(url: URL) -> Path | None:
    """The file that a database of SQLite lies in; None for one that lies in none."""
    plain = url.get_backend_name() == "sqlite" and url.database and not url.database.startswith(("file:", ":memory:"))
    return Path(str(url.database)) if plain else None


def file_is_gone(engine: Engine) -> bool:
    """Whether the engine's database is a file of SQLite that is not there, or not any more."""
    file = file_of(engine.url)
    return file is not None and not file.exists()


def stamp_of(engine: Engine) -> tuple[int, int] | None:
    """Which file of SQLite the engine's database is, None where it is not there or no file: another has another one."""
    file = file_of(engine.url)
    try:
        found = None if file is None else file.stat()
    except OSError:
        return None
    return None if found is None else (found.st_dev, found.st_ino)


def prepare_file(engine: Engine) -> None:
    """Let a file of SQLite that an earlier version has made give back room too; a large one is left as it is."""
    file = file_of(engine.url)
    if file is None or not file.exists() or file.stat().st_size > _SMALL_BYTES:
        return
    with engine.connect() as connection:
        # Outside transactions, which SQLAlchemy would begin.
        driver: Any = connection.connection.driver_connection
        try:
            if driver.execute("PRAGMA auto_vacuum").fetchone()[0] == 0:
                driver.execute("PRAGMA auto_vacuum = INCREMENTAL")
                driver.execute("VACUUM")
        except sqlite3.Error as error:
            raise DatabaseError(str(error)) from error


def first_line(error: Exception) -> str:
    """What went wrong, without what SQLAlchemy adds: the statement, and a link below it."""
    said = str(error.orig) if isinstance(error, DBAPIError) and error.orig is not None else str(error)
    lines = said.strip().splitlines()
    return lines[0] if lines else type(error).__name__


def _prepare_sqlite(engine: Engine, *, reads: bool) -> None:
    """Readers and the writer do not block each other, and a crash of the process loses nothing that was committed."""
    file = file_of(engine.url)
    pragmas = [f"busy_timeout = {round(1000 * WAIT_S)}", "synchronous = NORMAL"]
    if reads:
        pragmas.append("query_only = ON")
    else:
        pragmas += ["auto_vacuum = INCREMENTAL", "journal_mode = WAL"]
        pragmas += [f"journal_size_limit = {_LOG_BYTES}", f"wal_autocheckpoint = {_LOG_PAGES}"]

    @event.listens_for(engine, "connect")
    def _connected(connection: Any, record: Any) -> None:
        # Transactions are begun below, so that tables are made in them too.
        connection.isolation_level = None
        cursor = connection.cursor()
        for pragma in pragmas:
            cursor.execute(f"PRAGMA {pragma}")
        cursor.close()
        record.info["file"] = _identity(file)

    @event.listens_for(engine, "checkout")
    def _taken(_connection: Any, record: Any, _proxy: Any) -> None:
        # Otherwise SQLite would go on with the file that has no name any more.
        if record.info.get("file") != _identity(file):
            raise DisconnectionError("the file is another one")

    @event.listens_for(engine, "begin")
    def _begun(connection: Connection) -> None:
        connection.exec_driver_sql("BEGIN" if reads else "BEGIN IMMEDIATE")


def _identity(file: Path | None) -> tuple[int, int] | None:
    """Which file it is, whatever its name."""
    try:
        found = file.stat() if file else None
    except OSError:
        return None
    return None if found is None else (found.st_dev, found.st_ino)


def _prepare_postgresql(engine: Engine, *, reads: bool) -> None:
    """A server that is stopped, or behind a cable that was cut, is noticed within seconds."""
    import psycopg

    class Impatient(psycopg.Connection[Any]):
        """Gives up on a server that does not answer: the driver alone would wait for ever."""

        patience_s = SILENCE_S

        def wait(self, gen: Any, interval: float = 0.1, timeout: float | None = None) -> Any:
            """What comes of a generator of the driver's; OperationalError if that takes too long."""
            try:
                return super().wait(gen, interval, timeout or self.patience_s)
            except psycopg.errors._WaitTimeout as error:
                self.pgconn.finish()
                raise psycopg.OperationalError(f"no answer for {self.patience_s:g} s") from error

    milliseconds = round(1000 * WAIT_S)
    options = [f"statement_timeout={round(1000 * SILENCE_S) - 500}", f"lock_timeout={milliseconds}"]
    if reads:
        options.append("default_transaction_read_only=on")
    usual: dict[str, Any] = {
        "connect_timeout": CONNECT_S,
        "options": " ".join(f"-c {option}" for option in options),
        "keepalives_idle": 2,
        "keepalives_interval": 1,
        "keepalives_count": 2,
        "tcp_user_timeout": 4000,
        "application_name": "covista",
    }

    @event.listens_for(engine, "do_connect")
    def _connecting(_dialect: Any, _record: Any, arguments: Any, parameters: dict[str, Any]) -> Any:
        # What the URL says goes first.
        return Impatient.connect(*arguments, **(usual | parameters))


# What may come of a database that cannot be used as it is.
UNUSABLE = (SQLAlchemyError, OSError, DatabaseError)


def is_passing(error: Exception) -> bool:
    """Is it the database that cannot be used, and not what was to be stored?"""
    if isinstance(error, StatementError):
        # What comes of the database itself, but for values that it does not take.
        return isinstance(error, DBAPIError) and not isinstance(error, DataError | IntegrityError)
    return isinstance(error, UNUSABLE)
