"""Rows that take the place of those with the same key."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import Connection, Table, and_, bindparam, delete
from sqlalchemy.dialects import postgresql, sqlite

Row = dict[str, object]


def upsert(connection: Connection, table: Table, rows: Sequence[Row]) -> None:
    """Insert rows, all with the same columns, or put them in the place of those with the same key."""
    if not rows:
        return
    insert = postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
    statement = insert(table).inline()
    keys = [column.name for column in table.primary_key]
    others = {name: statement.excluded[name] for name in rows[0] if name not in keys}
    connection.execute(statement.on_conflict_do_update(index_elements=keys, set_=others), rows)


def remove(connection: Connection, table: Table, keys: Sequence[tuple[object, ...]]) -> None:
    """Delete the rows with these keys, if they are there."""
    if not keys:
        return
    columns = list(table.primary_key)
    which = and_(*(column == bindparam(f"key_{column.name}") for column in columns))
    rows = [{f"key_{column.name}": value for column, value in zip(columns, key, strict=True)} for key in keys]
    connection.execute(delete(table).where(which), rows)
