"""The way from any former version to this one, by Alembic: asked for only where there is a way to go."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, inspect

from covista_service.store.database import DatabaseError

# The tables as they were before they were numbered.
FIRST = "0001"


def go(connection: Connection, present: str | None) -> None:
    """Bring the database from its `present` version to the newest. Raises DatabaseError if it is of a newer one."""
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent).replace("%", "%%"))
    config.attributes["connection"] = connection
    known = {each.revision for each in ScriptDirectory.from_config(config).walk_revisions()}
    if present is not None and present not in known:
        raise DatabaseError(f"it was made by a newer version (its schema is {present}): upgrade, or use another one")
    if present is None and inspect(connection).has_table("group_revisions"):
        command.stamp(config, FIRST)
    command.upgrade(config, "head")
