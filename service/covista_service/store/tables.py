"""What is stored, and how it is written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from covista_schemas.reports import EventReport, GroupsReport
from sqlalchemy import BigInteger, Column, Connection, Integer, MetaData, String, Table, Text, func, insert, select

metadata = MetaData()

# A key of our own: numbers may come twice if a database was out of reach when the station started.
_KEY = BigInteger().with_variant(Integer, "sqlite")

group_revisions = Table(
    "group_revisions",
    metadata,
    Column("id", _KEY, primary_key=True, autoincrement=True),
    Column("revision", BigInteger, nullable=False, index=True),
    Column("time_us", BigInteger, nullable=False, index=True),
    Column("report", Text, nullable=False),
)

events = Table(
    "events",
    metadata,
    Column("id", _KEY, primary_key=True, autoincrement=True),
    Column("number", BigInteger, nullable=False, index=True),
    Column("time_us", BigInteger, nullable=False, index=True),
    Column("kind", String(32), nullable=False),
    Column("report", Text, nullable=False),
)

Entry = GroupsReport | EventReport
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


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


def write(connection: Connection, entries: Sequence[Entry]) -> None:
    """Append entries."""
    revisions = [_revision(entry) for entry in entries if isinstance(entry, GroupsReport)]
    happened = [_event(entry) for entry in entries if isinstance(entry, EventReport)]
    if revisions:
        connection.execute(insert(group_revisions), revisions)
    if happened:
        connection.execute(insert(events), happened)


def _revision(entry: GroupsReport) -> dict[str, object]:
    return {"revision": entry.revision, "time_us": _microseconds(entry.time), "report": entry.model_dump_json()}


def _event(entry: EventReport) -> dict[str, object]:
    return {
        "number": entry.id,
        "time_us": _microseconds(entry.time),
        "kind": entry.event.value,
        "report": entry.model_dump_json(),
    }


def _microseconds(time: datetime) -> int:
    since = time - _EPOCH
    return (since.days * 86_400 + since.seconds) * 1_000_000 + since.microseconds
