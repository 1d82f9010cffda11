"""A clock that is set back: within the station time goes on, and what it tells is of the time that others know."""

from itertools import pairwise

import pytest
from covista_schemas.reports import FoundBy, Status
from covista_service.answers.grouping import groups_report
from covista_service.station.events import GroupsEvaluated, Happened, KeyframeId, PoseArrived, Tick, TokenSeen
from covista_service.station.timeline import Timeline
from hypothesis import given
from hypothesis import strategies as st

from tests.service.station.scenes import BACK, NOTHING, SEEN, START_NS, S, Scene, evaluated, pose

HOUR_NS = 3600 * S


def seen(**options: object) -> Scene:
    """Two robots that look at one wall, and a third that looks away."""
    scene = Scene.of(**options)
    for robot, at in (("r1", pose(0)), ("r2", pose(1)), ("r3", pose(0, BACK))):
        scene.send(robot, at)
    scene.settle(lambda job: NOTHING if job.second.robot == "r3" else SEEN)
    return scene


@given(st.lists(st.integers(-10, 10)))
def test_it_never_falls_and_goes_on_as_fast_as_the_wall(steps: list[int]) -> None:
    line, wall_ns = Timeline(), 100
    read = [line.at(wall_ns)]
    for step in steps:
        wall_ns += step
        read.append(line.at(wall_ns))
        assert line.wall_ns(read[-1]) == wall_ns
        assert line.peek(wall_ns - 5) == read[-1] == line.peek(wall_ns)
        assert line.peek(wall_ns + 5) == read[-1] + 5
    assert [later - sooner for sooner, later in pairwise(read)] == [max(step, 0) for step in steps]


def test_what_came_before_the_clock_was_set_back_came_just_now() -> None:
    line = Timeline()
    line.at(1000)
    early, late = (PoseArrived("r1", "b0", k, 5, arrived_ns, pose()) for k, arrived_ns in enumerate((990, 390)))
    assert line.heard(early) is early
    now_ns = line.at(400)
    assert [line.heard(event).arrived_ns for event in (early, late)] == [now_ns, 990]
    assert line.at(500) == 1100
    assert line.heard(late).arrived_ns == 990


def test_what_is_told_is_of_the_time_on_the_wall() -> None:
    line = Timeline()
    line.at(1000)
    line.at(400)
    name = KeyframeId("r1", "b0", 0)
    happened, groups = line.told([Happened("status", 1000, "r1 is live"), GroupsEvaluated(((name, 990),))])
    assert (happened.time_ns, groups.keyframes) == (400, ((name, 390),))


@pytest.mark.parametrize("back_s", [1, 3600])
def test_answers_decay_and_are_unknown_when_their_time_has_come(back_s: int) -> None:
    scene = seen(gone_after_s=5000, forget_after_s=5000)
    scene.wait(10)
    scene.now_ns -= back_s * S
    for age_s, found_by in (
        (10, None),
        (59, None),
        (60, FoundBy.DECAYED),
        (599, FoundBy.DECAYED),
        (600, FoundBy.UNKNOWN),
    ):
        scene.now_ns = START_NS + 10 * S - back_s * S + (age_s - 10) * S
        scene.tick()
        for pair, fresh in ((("r1", "r2"), FoundBy.IMAGE), (("r1", "r3"), FoundBy.PREDICTED)):
            view = scene.snapshot.pair(*pair)
            assert view.found_by is (found_by or fresh)
            assert view.age_s == (None if age_s >= 600 else age_s)


def test_presence_is_right_while_robots_send_and_when_they_stop() -> None:
    scene = seen()
    scene.wait(1)
    scene.now_ns -= HOUR_NS
    for _ in range(20):
        scene.now_ns += S
        for robot in ("r1", "r2", "r3"):
            scene.send_pose(robot, pose(0))
        scene.tick()
        robots = scene.snapshot.robots.values()
        assert {robot.status for robot in robots} == {Status.LIVE}
        assert {robot.last_seen_ns for robot in robots} == {scene.now_ns}
        assert {robot.clock_offset_s for robot in robots} == {0.0}
    scene.wait(6)
    assert {robot.status for robot in scene.snapshot.robots.values()} == {Status.STALE}
    scene.wait(30)
    assert {robot.status for robot in scene.snapshot.robots.values()} == {Status.GONE}
    scene.wait(600)
    assert scene.snapshot.robots == {}


def test_keyframes_are_surveyed_and_answers_are_young_after_it() -> None:
    scene = seen()
    scene.now_ns -= HOUR_NS
    for _ in range(5):
        scene.now_ns += S
        scene.send("r1", pose(0))
        told = scene.settle()
        view = scene.snapshot.pair("r1", "r2")
        assert (view.found_by, view.age_s) == (FoundBy.IMAGE, 0.0)
        assert [arrived_ns for _, arrived_ns in evaluated(told)] == [scene.now_ns]


def test_groups_and_events_are_of_the_time_on_the_wall() -> None:
    scene = seen()
    scene.now_ns -= HOUR_NS
    scene.receive(TokenSeen("r4", "b0"))
    told = scene.tick()
    assert {effect.time_ns for effect in told if isinstance(effect, Happened)} == {scene.now_ns}
    assert scene.snapshot.groups.time_ns == scene.now_ns
    scene.now_ns += 5 * S
    scene.receive(Tick())
    assert scene.snapshot.groups.time_ns == scene.now_ns - 5 * S


def test_before_there_are_groups_the_report_is_of_now() -> None:
    scene = Scene()
    scene.tick()
    scene.now_ns -= HOUR_NS
    assert groups_report(scene.snapshot).time.timestamp() == scene.now_ns / S
