"""A station that is killed and started again goes on: robots, overlaps, groups and their labels, and all numbers."""

import signal
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from covista_clients import MissionControl, Rover
from covista_schemas.messages import Pose
from covista_schemas.reports import FoundBy, GroupsReport
from covista_service.store.archive import Archive

from tests.service.deadline import free_endpoint, wait_until
from tests.service.wall import CAMERA, overlap, seen_from
from tests.system.test_serve import serving

NOW = ("robots_now", "pairs_now")


@contextmanager
def station(folder: Path, link: str) -> Iterator[tuple[object, MissionControl]]:
    with serving(folder, "--link", link) as (process, url), MissionControl(url) as control:
        wait_until(lambda: control.health().status == "ready", "the station is ready", 100)
        yield process, control


def settled(control: MissionControl) -> GroupsReport | None:
    """The groups once r1 and r2 stand in one."""
    groups = control.groups()
    return groups if any(group.robots == ["r1", "r2"] for group in groups.groups) else None


def remembered(database: Path) -> tuple[int, ...]:
    """How many robots and pairs a station would know if it were started now."""
    with closing(sqlite3.connect(database)) as connection:
        return tuple(connection.execute(f"select count(*) from {name}").fetchone()[0] for name in NOW)


def test_a_station_that_was_killed_goes_on_where_it_was(tmp_path: Path) -> None:
    link = free_endpoint()
    url = f"sqlite:///{tmp_path / 'covista.db'}"
    archive = Archive(url)
    with (
        station(tmp_path, link) as (process, control),
        Rover("r1", CAMERA, link) as first,
        Rover("r2", CAMERA, link) as second,
    ):
        for rover, x_m in ((first, 0.0), (second, 1.0)):
            rover.send_keyframe(seen_from(x_m), Pose((x_m, 0, 0)))
        groups = wait_until(lambda: settled(control), "the rovers are grouped")
        # What the station knew a second ago is in its database.
        wait_until(lambda: archive.pair("r1", "r2").items and len(archive.track("r2").items), "it is written")
        wait_until(lambda: archive.groups().items[-1].revision == groups.revision)
        wait_until(lambda: remembered(tmp_path / "covista.db") == (2, 1), "robots and pair are remembered")
        process.send_signal(signal.SIGKILL)
        process.wait()
    events = archive.events().items
    assert events
    with station(tmp_path, link) as (_, control):
        again = control.groups()
        assert again.groups == groups.groups
        assert again.revision >= groups.revision
        pair = control.pair("r2", "r1")
        assert pair.found_by is FoundBy.DECAYED
        assert pair.overlap_a == pytest.approx(overlap(1.0), abs=0.05)
        assert [robot.id for robot in control.robots().robots] == ["r1", "r2"]
        with Rover("r3", CAMERA, link) as third:
            third.send_keyframe(seen_from(2.0), Pose((2.0, 0, 0)))
            wait_until(lambda: control.groups().revision > groups.revision, "the newcomer is placed")
        later = wait_until(lambda: archive.events_after(events[-1].id), "what happens next is written")
        assert len({event.id for event in [*events, *later]}) == len(events) + len(later)
    archive.close()
