"""What is told as rows of the history's tables."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from covista_schemas.reports import EventReport, FoundBy, GroupsReport, LiveSettings
from sqlalchemy import Connection, Table, insert

from covista_service.store.moments import microseconds
from covista_service.store.tables import POSE, events, group_revisions, pair_overlaps, settings_changes, tracks


@dataclass(frozen=True, slots=True)
class SettingsChange:
    """Live settings as they are from `time` on, what of them was given (`patch`), and by whom."""

    time: datetime
    by: str | None
    patch: Mapping[str, object]
    settings: LiveSettings


@dataclass(frozen=True, slots=True)
class TrackEntry:
    """Where a robot's camera was: `pose` is position in metres and orientation, as in `tables.POSE`."""

    robot: str
    time_us: int
    pose: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PairEntry:
    """The overlap of a pair, a < b, from a moment on."""

    a: str
    b: str
    time_us: int
    overlap_a: float | None
    overlap_b: float | None
    found_by: FoundBy


Entry = GroupsReport | EventReport | SettingsChange | TrackEntry | PairEntry


def write(connection: Connection, entries: Sequence[Entry]) -> None:
    """Append entries."""
    rows: dict[Table, list[dict[str, object]]] = {}
    for entry in entries:
        table, row = _row(entry)
        rows.setdefault(table, []).append(row)
    for table, of_it in rows.items():
        connection.execute(insert(table).inline(), of_it)


def time_us_of(entry: Entry) -> int:
    """When it was."""
    return entry.time_us if isinstance(entry, TrackEntry | PairEntry) else microseconds(entry.time)


def _row(entry: Entry) -> tuple[Table, dict[str, object]]:
    match entry:
        case TrackEntry():
            pose = dict(zip(POSE, entry.pose, strict=True))
            return tracks, {"robot": entry.robot, "time_us": entry.time_us, **pose}
        case PairEntry():
            return pair_overlaps, {
                "a": entry.a,
                "b": entry.b,
                "time_us": entry.time_us,
                "overlap_a": entry.overlap_a,
                "overlap_b": entry.overlap_b,
                "found_by": entry.found_by.value,
            }
        case GroupsReport():
            report = {"time_us": microseconds(entry.time), "report": entry.model_dump_json()}
            return group_revisions, {"revision": entry.revision, **report}
        case EventReport():
            report = {"time_us": microseconds(entry.time), "report": entry.model_dump_json()}
            return events, {"number": entry.id, "kind": entry.event.value, **report}
        case SettingsChange():
            settings = {"patch": json.dumps(dict(entry.patch)), "settings": entry.settings.model_dump_json()}
            return settings_changes, {"time_us": microseconds(entry.time), "by": entry.by, **settings}
