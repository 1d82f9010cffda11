"""Robots far from where their keyframes were taken are held against one another where they stand."""

import pytest
from covista_schemas.reports import FoundBy

from tests.service.station.scenes import AHEAD, BACK, NOTHING, S, Scene, measured, pose
from tests.service.station.test_forecasts import CELL, PER_M, robots
from tests.service.station.test_neighbourhoods import mutual, partners
from tests.service.station.test_pairs import pair


def sides() -> Scene:
    """r1 and r2 look ahead, r3 and r4 back, all having seen their wall."""
    scene = robots()
    for k, robot in ((0, "r3"), (1, "r4")):
        scene.send(robot, pose(k, BACK))
    scene.settle(inside)
    return scene


def inside(job):
    return measured() if (job.first.robot < "r3") == (job.second.robot < "r3") else NOTHING


def test_a_keyframe_of_the_other_does_not_undo_what_poses_say() -> None:
    scene = sides()
    scene.send_pose("r1", pose(0, BACK))
    scene.tick()
    assert pair(scene, "r1", "r3").overlap_a == pytest.approx(1, abs=CELL)
    for number in range(3):
        scene.now_ns += S
        scene.send("r3", pose(0, BACK))
        told = scene.tick()
        view = pair(scene, "r1", "r3")
        assert (view.overlap_a, view.found_by) == (pytest.approx(1, abs=CELL), FoundBy.PREDICTED)
        assert view.keyframe_b.id.sequence == number + 1
        assert mutual(scene, "r1", "r3") > 0.2
        # Their keyframes show different walls.
        assert "r3" not in partners(scene.station, "r1")
        scene.work(told, inside)
        assert pair(scene, "r1", "r3").overlap_a == pytest.approx(1, abs=CELL)


def test_who_comes_to_the_same_place_by_poses_alone_shares_what_is_there() -> None:
    scene = sides()
    for robot in ("r1", "r3"):
        scene.send_pose(robot, pose(50, AHEAD))
        scene.tick()
    assert pair(scene, "r1", "r3").overlap_a == pytest.approx(1, abs=CELL)
    assert mutual(scene, "r1", "r3") > 0.2
    scene.send_pose("r3", pose(51, AHEAD))
    scene.tick()
    assert pair(scene, "r1", "r3").overlap_a == pytest.approx(1 - PER_M, abs=CELL)
    scene.send_pose("r3", pose(0, BACK))
    scene.tick()
    assert pair(scene, "r1", "r3").overlap_a == 0
    assert mutual(scene, "r1", "r3") == 0


def test_a_newcomer_is_held_against_who_stands_where_it_looks() -> None:
    scene = sides()
    scene.send_pose("r1", pose(50, AHEAD))
    scene.tick()
    scene.send("r5", pose(50, AHEAD))
    scene.tick()
    assert ("r1", "r5") in scene.snapshot.records
    assert ("r3", "r5") not in scene.snapshot.records


def test_nothing_stands_far_from_its_keyframe_that_has_come_back_or_sent_another() -> None:
    scene = sides()
    hoods = scene.station._surveys.neighbourhoods
    scene.send_pose("r1", pose(0, BACK))
    scene.send_pose("r2", pose(9, AHEAD))
    scene.tick()
    assert set(hoods._standing) == {"r1", "r2"}
    scene.send_pose("r1", pose(0.01, AHEAD))
    scene.send("r2", pose(9, AHEAD))
    scene.tick()
    assert (hoods._standing, len(hoods._ground)) == ({}, 0)


def test_where_no_forecasts_are_allowed_nobody_stands_anywhere_else() -> None:
    scene = robots(forecasts_per_s=0)
    scene.send_pose("r1", pose(0, BACK))
    scene.tick()
    assert scene.station._surveys.neighbourhoods._standing == {}


def test_a_robot_with_many_partners_has_one_turn_for_one_pose_and_another_for_the_next() -> None:
    scene = robots(8, forecasts_per_s=40)
    forecasts = scene.station._surveys.forecasts
    scene.now_ns += S
    scene.send_pose("r1", pose(0.5))
    scene.tick()
    # The allowance is for five partners of seven.
    assert [len(turn.rest or ()) for turn in forecasts._waiting.values()] == [2]
    scene.wait(0.2)
    assert forecasts._waiting == {}
    scene.wait(1)
    scene.send_pose("r1", pose(1.0))
    scene.tick()
    scene.send_pose("r1", pose(1.5))
    told_ns = scene.now_ns
    while scene.station.waits:
        scene.wait(0.2)
    assert {pair(scene, "r1", f"r{k}").stands_for_ns[0] for k in range(2, 9)} == {told_ns}
