"""Brings a database to the tables of this version, whichever version has made it."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, inspect, text

from covista_service.store.database import DatabaseError

# The tables as they were before they were numbered.
FIRST = "0001"
# Any number that other users of the same server are not likely to take.
_LOCK = 0x636F7669


def upgrade(connection: Connection) -> None:
    """Bring the database up to date, in the transaction of `connection`. Raises DatabaseError if it is a newer one."""
    if connection.dialect.name == "postgresql":
        # Two stations that start at once do it one after the other.
        connection.execute(text(f"SELECT pg_advisory_xact_lock({_LOCK})"))
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent).replace("%", "%%"))
    config.attributes["connection"] = connection
    script = ScriptDirectory.from_config(config)
    present = MigrationContext.configure(connection).get_current_revision()
    if present == script.get_current_head():
        return
    if present is not None and present not in {each.revision for each in script.walk_revisions()}:
        raise DatabaseError(f"it was made by a newer version (its schema is {present}): upgrade, or use another one")
    if present is None and inspect(connection).has_table("group_revisions"):
        command.stamp(config, FIRST)
    command.upgrade(config, "head")
