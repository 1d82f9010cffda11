"""Where numbering stood when the station was last running."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import Connection, func, select

from covista_service.store.tables import events, group_revisions


@dataclass(frozen=True, slots=True)
class LastNumbers:
    """The highest revision and event number stored; 0 for none."""

    revision: int = 0
    event: int = 0


def read_last_numbers(connection: Connection) -> LastNumbers:
    """Where numbering stood when the station was last running."""
    revision = connection.execute(select(func.max(group_revisions.c.revision))).scalar()
    event = connection.execute(select(func.max(events.c.number))).scalar()
    return LastNumbers(revision or 0, event or 0)
