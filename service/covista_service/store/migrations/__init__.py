"""Brings a database to the tables of this version, whichever version has made it."""

from __future__ import annotations

from sqlalchemy import Connection, inspect, text

# The version of the tables as they are now: the last of `versions`.
NEWEST = "0002"
# Any number that other users of the same server are not likely to take.
_LOCK = 0x636F7669


def upgrade(connection: Connection) -> None:
    """Bring the database up to date, in the transaction of `connection`. Raises DatabaseError if it is a newer one."""
    if connection.dialect.name == "postgresql":
        # Two stations that start at once do it one after the other.
        connection.execute(text(f"SELECT pg_advisory_xact_lock({_LOCK})"))
    present = _present(connection)
    if present != NEWEST:
        # Alembic takes a tenth of a start, and is wanted at the first one of a version alone.
        from covista_service.store.migrations import steps

        steps.go(connection, present)


def _present(connection: Connection) -> str | None:
    """The version that Alembic has put down in the database."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    return connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one_or_none()
