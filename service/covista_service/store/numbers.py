"""Numbers that are never used twice: revisions of the groups, events, and labels of groups.

They are reserved in the database a block ahead of those in use. A station that was killed may have used any of its
block, so the next one begins above; one that ended in peace gives back what it has not used.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields

from sqlalchemy import Connection, Table, func, insert, select, update

from covista_service.store.tables import events, group_revisions, numbers

# Labels are not stored by themselves: of a database without numbers the last so many reports tell them.
_REPORTS = 1000


@dataclass(frozen=True, slots=True)
class LastNumbers:
    """The highest revision, event and number of a label (g7 is 7) that may have been used; 0 for none."""

    revision: int = 0
    event: int = 0
    label: int = 0

    def over(self, other: LastNumbers) -> LastNumbers:
        """The higher of each."""
        return LastNumbers(*map(max, astuple(self), astuple(other)))


BLOCK = LastNumbers(revision=1000, event=10_000, label=1000)
_NAMES = tuple(each.name for each in fields(LastNumbers))


def last_used(connection: Connection) -> LastNumbers:
    """Up to where numbers may have been used, by what is reserved and what is stored."""
    reserved = {row.name: row.reserved for row in connection.execute(select(numbers).with_for_update())}
    revision = connection.execute(select(func.max(group_revisions.c.revision))).scalar() or 0
    event = connection.execute(select(func.max(events.c.number))).scalar() or 0
    label = 0 if "label" in reserved else max(_labels(connection, group_revisions), _labels(connection, events))
    return LastNumbers(revision, event, label).over(LastNumbers(*(reserved.get(name, 0) for name in _NAMES)))


def ahead(reserved: LastNumbers, used: LastNumbers) -> LastNumbers:
    """What is to be reserved: another block for each of which half is used."""
    return LastNumbers(
        *(
            now if number <= now - block // 2 else number + block
            for now, number, block in zip(astuple(reserved), astuple(used), astuple(BLOCK), strict=True)
        )
    )


def reserve(connection: Connection, upto: LastNumbers) -> None:
    """Write down up to where numbers may be used."""
    for name, number in zip(_NAMES, astuple(upto), strict=True):
        changed = connection.execute(update(numbers).where(numbers.c.name == name).values(reserved=number))
        if not changed.rowcount:
            connection.execute(insert(numbers).values(name=name, reserved=number))


def _label(labels: Iterable[str]) -> int:
    """The highest number of labels such as g7."""
    return max((int(each[1:]) for each in labels if each[:1] == "g" and each[1:].isdecimal()), default=0)


def _labels(connection: Connection, table: Table) -> int:
    """The highest number of a label in the last reports."""
    found: list[str] = []
    for text in connection.execute(select(table.c.report).order_by(table.c.id.desc()).limit(_REPORTS)).scalars():
        try:
            report = json.loads(text)
            found += report.get("labels", [])
            found += [group["label"] for group in report.get("groups", [])]
        except (ValueError, TypeError, KeyError, AttributeError):
            # Whatever it is, it names no label.
            continue
    return _label(each for each in found if isinstance(each, str))
