"""How long the history is kept, and how large it may become: what is too old, or too much, goes in small steps."""

from __future__ import annotations

import json
from dataclasses import dataclass

from sqlalchemy import ColumnElement, Connection, Table, and_, delete, select

from covista_service.store.tables import events, gaps, group_revisions, pair_overlaps, settings_changes, tracks

# Rows that one step removes at most: some milliseconds.
STEP = 1000
# What is removed for its size is as old everywhere, within this.
_EVEN_US = 600_000_000
# Settings that were given are kept for what they name, but no more than so many that name nothing of their own.
MOST_CHANGES = 2000
# No more are read at a time: what is behind them comes into sight as those before it go.
READ_CHANGES = 10_000
PAST = (tracks, pair_overlaps, events, group_revisions, gaps)


@dataclass(frozen=True, slots=True)
class Retention:
    """Days that entries are kept, and MB (1e6 bytes) that the database may take: what is first."""

    days: float = 30.0
    mb: float = 1024.0

    @property
    def span_us(self) -> int:
        """How long entries are kept."""
        return round(self.days * 86_400e6)

    @property
    def limit_bytes(self) -> int:
        """How large the database may become."""
        return round(self.mb * 1e6)


def drop_older(connection: Connection, cutoff_us: int) -> bool:
    """Remove some of what is older; True if there may be more.

    Of revisions the one that was in force then stays.
    """
    removed = [_drop(connection, table, cutoff_us) for table in PAST]
    return any(removed)


def drop_oldest(connection: Connection) -> bool:
    """Remove some of what is oldest, whatever it is; False if there is nothing."""
    oldest = [(_oldest_us(connection, table), table) for table in PAST]
    present = sorted(((time_us, k) for k, (time_us, _) in enumerate(oldest) if time_us is not None))
    for place, (time_us, k) in enumerate(present):
        # Down to where the next table begins.
        until_us = present[place + 1][0] if place + 1 < len(present) else time_us
        if _drop(connection, PAST[k], until_us + _EVEN_US):
            return True
    return False


def drop_superseded(connection: Connection, cutoff_us: int) -> bool:
    """Remove some of the settings that were given before, as far as newer ones name all that they name.

    Those that are older, and those behind the newest `MOST_CHANGES`. True if there may be more.
    """
    newer: set[str] = set()
    superseded: list[int] = []
    rows = newest_changes(connection)
    for place, (key, time_us, text) in enumerate(rows):
        names = set(patch_of(text))
        if (time_us < cutoff_us or place >= MOST_CHANGES) and names <= newer:
            superseded.append(key)
        newer |= names
    if superseded:
        connection.execute(delete(settings_changes).where(settings_changes.c.id.in_(superseded[-STEP:])))
    return len(superseded) > STEP or (bool(superseded) and len(rows) == READ_CHANGES)


def newest_changes(connection: Connection) -> list[tuple[int, int, str]]:
    """Key, time and patch of the settings given last, the newest first; no more than `READ_CHANGES`."""
    changes = settings_changes.c
    newest = select(changes.id, changes.time_us, changes.patch).order_by(changes.id.desc()).limit(READ_CHANGES)
    return [(key, time_us, patch) for key, time_us, patch in connection.execute(newest)]


def patch_of(text: str) -> dict[str, object]:
    """A patch as it was stored; nothing if it cannot be read."""
    try:
        patch = json.loads(text)
    except ValueError:
        return {}
    return patch if isinstance(patch, dict) else {}


def _time_us(table: Table) -> ColumnElement[int]:
    return table.c.until_us if table is gaps else table.c.time_us


def _oldest_us(connection: Connection, table: Table) -> int | None:
    return connection.execute(select(_time_us(table)).order_by(table.c.id).limit(1)).scalar()


def _drop(connection: Connection, table: Table, cutoff_us: int) -> bool:
    """Keys are in the order of writing: so far as they come first and are older, whatever comes late."""
    key, time_us = table.c.id, _time_us(table)
    first = connection.execute(select(key, time_us).order_by(key).limit(STEP)).all()
    older = [row for row in first if row[1] < cutoff_us]
    if not older:
        return False
    which = and_(key <= older[-1][0], time_us < cutoff_us)
    if table is group_revisions:
        in_force = select(key).where(time_us < cutoff_us).order_by(time_us.desc(), key.desc()).limit(1)
        which = and_(which, key != in_force.scalar_subquery())
    return connection.execute(delete(table).where(which)).rowcount > 0
