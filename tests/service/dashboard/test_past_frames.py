"""Going back in time shows the recorded groups exactly, and of places and overlaps what was known then."""

import math
import random
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest
from covista_schemas.reports import FoundBy, GroupsReport
from covista_service.answers.robots import quaternion_of
from covista_service.dashboard.frames import corners
from covista_service.perception.camera import Pose
from covista_service.store.rows import PairEntry, TrackEntry

from tests.service.dashboard.conftest import PagesDesk, at, groups, us
from tests.service.station.scenes import CAMERA, pose

ROBOTS = [f"r{k}" for k in range(1, 9)]


def point(robot: str, seconds: float, x_m: float = 0.0) -> TrackEntry:
    return TrackEntry(robot, us(seconds), (x_m, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0))


def past(desk: PagesDesk, seconds: float) -> dict[str, object]:
    return desk.data(f"/past?time={quote(at(seconds).isoformat())}")


def column(frame: dict[str, object], name: str) -> dict[str, object]:
    robots = frame["robots"]
    assert isinstance(robots, dict)
    return dict(zip(robots["id"], robots[name], strict=True))


@pytest.mark.parametrize("seed", range(3))
def test_scrubbing_back_gives_the_recorded_groups_exactly(pages_desk: PagesDesk, seed: int) -> None:
    chance = random.Random(seed)
    recorded: list[tuple[float, GroupsReport]] = []
    for revision in range(1, 40):
        seconds = 10 * revision + chance.random()
        standing: dict[str, list[str]] = {}
        gone = chance.sample(ROBOTS, chance.randrange(3))
        for robot in ROBOTS:
            if robot not in gone:
                standing.setdefault(f"g{chance.randrange(1, 5)}", []).append(robot)
        recorded.append((seconds, groups(revision, seconds, standing, gone)))
    pages_desk.write(*(report for _, report in recorded))
    exactly = [seconds for seconds, _ in recorded]
    for seconds in [*exactly[::6], *(chance.uniform(5, 500) for _ in range(20))]:
        frame = past(pages_desk, seconds)
        before = [report for since, report in recorded if us(since) <= us(seconds)]
        told = column(frame, "group")
        if not before:
            assert not told
            continue
        wanted = {robot: group.label for group in before[-1].groups for robot in group.robots}
        assert {robot: label for robot, label in told.items() if label is not None} == wanted
        assert frame["revision"] == before[-1].revision
        assert {robot for robot, why in column(frame, "reason").items() if why == "gone"} == {
            each.robot for each in before[-1].ungrouped
        }


def test_a_moment_has_the_form_of_now(pages_desk: PagesDesk) -> None:
    pages_desk.scene.send("r1")
    pages_desk.scene.send("r2")
    pages_desk.scene.settle()
    pages_desk.write(groups(1, 0, {"g1": ["r1"]}), point("r1", 0))
    now, then = pages_desk.data("/swarm"), past(pages_desk, 1)
    assert now.keys() <= then.keys()
    assert isinstance(then["robots"], dict)
    assert now["robots"].keys() == then["robots"].keys()
    assert now["edges"].keys() == then["edges"].keys()  # type: ignore[attr-defined]


def test_places_and_overlaps_are_those_known_last(pages_desk: PagesDesk) -> None:
    pages_desk.write(groups(1, 0, {"g1": ["r1", "r2"], "g2": ["r3"]}), point("r1", 0, 1), point("r1", 30, 2))
    pages_desk.write(point("r2", 0, 5), PairEntry("r1", "r2", us(10), 0.5, 0.25, FoundBy.IMAGE))
    assert column(past(pages_desk, 29), "at_m") == {"r1": [1, 2, 3], "r2": [5, 2, 3], "r3": None}
    assert column(past(pages_desk, 31), "at_m")["r1"] == [2, 2, 3]
    assert past(pages_desk, 9)["edges"] == {"robots": ["r1", "r2", "r3"], "pairs": []}
    assert past(pages_desk, 10)["edges"] == {"robots": ["r1", "r2", "r3"], "pairs": [[0, 1, 0.5, 0.25]]}
    # What was known ten minutes before says nothing any more, but the groups stand.
    late = past(pages_desk, 700)
    assert set(column(late, "at_m").values()) == {None}
    assert late["edges"] == {"robots": ["r1", "r2", "r3"], "pairs": []}
    assert column(late, "group") == {"r1": "g1", "r2": "g1", "r3": "g2"}


def test_who_had_been_silent_for_long_was_not_live(pages_desk: PagesDesk) -> None:
    pages_desk.write(groups(1, 0, {"g1": ["r1", "r2", "r3"]}, gone=["r4"]), point("r1", 100), point("r2", 0))
    assert column(past(pages_desk, 120), "status") == {"r1": "live", "r2": "stale", "r3": "stale", "r4": "gone"}
    assert column(past(pages_desk, 120), "silent_s") == {"r1": 20, "r2": 120, "r3": None, "r4": None}


def test_views_are_drawn_with_the_camera_that_is_known_now(pages_desk: PagesDesk) -> None:
    turn = math.radians(30)
    turned = np.array([[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0, math.cos(turn)]])
    pages_desk.scene.send("r1", pose())
    told = (1.0, 2.0, 3.0, *quaternion_of(turned))
    pages_desk.write(groups(1, 0, {"g1": ["r1", "r2"]}), TrackEntry("r1", us(0), told), point("r2", 0))
    views = column(past(pages_desk, 1), "view")
    assert views["r1"] == pytest.approx(corners(CAMERA, Pose(turned, np.array(told[:3]))), abs=2e-3)
    assert views["r2"] is None


@pytest.mark.parametrize("time", ["", "yesterday", "2026-05-04T12:30:15", "2026-13-04T12:30:15Z"])
def test_a_time_that_is_none_is_refused(pages_desk: PagesDesk, time: str) -> None:
    assert pages_desk.ask(f"/dashboard/data/past?time={time}").status_code == 422


def test_times_that_nothing_is_kept_of_are_empty(pages_desk: PagesDesk) -> None:
    for time in ("0001-01-01T00:00:00Z", "9999-12-30T00:00:00Z"):
        frame = pages_desk.data(f"/past?time={time}")
        assert frame["robots"]["id"] == []
        assert frame["revision"] is None


def test_a_history_that_cannot_be_read_is_a_problem(pages_desk: PagesDesk, tmp_path: Path) -> None:
    pages_desk.close()
    for file in tmp_path.glob("covista.db*"):
        file.unlink()
    for path in (f"/past?time={quote(at(0).isoformat())}", "/bands"):
        response = pages_desk.ask(f"/dashboard/data{path}")
        assert response.status_code == 503
        assert "history" in response.json()["detail"]
