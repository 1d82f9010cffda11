"""What is stored of a way and of an overlap: enough to know it within the thresholds, and no more."""

import numpy as np
import pytest
from covista_schemas.reports import FoundBy
from covista_service.station.events import ForgetRobot
from covista_service.store.rows import PairEntry, TrackEntry
from covista_service.store.sampler import Sampler, Thinning
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.scenes import BACK, NOTHING, START_NS, S, Scene, measured, pose


def turned(degrees: float) -> np.ndarray:
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])


def points(entries: list) -> list[tuple[str, float]]:
    return [(each.robot, each.pose[0]) for each in entries if isinstance(each, TrackEntry)]


def moments(entries: list) -> list[tuple]:
    return [(e.a, e.b, e.overlap_a, e.overlap_b) for e in entries if isinstance(e, PairEntry)]


def test_a_robot_that_does_not_move_is_told_once_and_again_each_minute() -> None:
    scene, sampler = Scene(), Sampler()
    told = []
    for second in range(130):
        scene.now_ns = START_NS + second * S
        scene.send_pose("r1", pose(1.0))
        told += [(each.time_us - START_NS // 1000) // 10**6 for each in sampler.look(scene.snapshot)]
    assert told == [0, 60, 120]


def test_a_robot_that_says_nothing_is_told_no_more() -> None:
    scene, sampler = Scene(), Sampler()
    scene.send_pose("r1", pose(1.0))
    assert points(sampler.look(scene.snapshot)) == [("r1", 1.0)]
    scene.now_ns += 1000 * S
    assert sampler.look(scene.snapshot) == []


@settings(max_examples=30)
@given(st.lists(st.floats(-0.3, 0.3), min_size=1, max_size=30))
def test_where_a_robot_was_is_known_within_the_threshold(steps_m: list[float]) -> None:
    scene, sampler, at_m, told_m = Scene(), Sampler(), 0.0, np.inf
    for step_m in steps_m:
        at_m += step_m
        scene.send_pose("r1", pose(at_m))
        for _, x in points(sampler.look(scene.snapshot)):
            told_m = x
        assert abs(told_m - at_m) <= Thinning().moved_m + 1e-9


@pytest.mark.parametrize(("degrees", "news"), [(0.0, False), (4.9, False), (5.1, True), (180.0, True), (-30.0, True)])
def test_who_turns_is_told(degrees: float, news: bool) -> None:
    scene, sampler = Scene(), Sampler()
    scene.send_pose("r1", pose())
    sampler.look(scene.snapshot)
    scene.send_pose("r1", pose(0.0, turned(degrees)))
    assert bool(sampler.look(scene.snapshot)) is news


def test_an_overlap_is_told_when_it_is_known_and_when_it_changes() -> None:
    scene, sampler = Scene(), Sampler()
    scene.send("r1")
    scene.send("r2")
    scene.settle(lambda job: measured(0.5, 0.6))
    assert moments(sampler.look(scene.snapshot)) == [("r1", "r2", 0.5, 0.6)]
    for q, news in ((0.54, False), (0.46, False), (0.44, True), (0.47, False), (0.38, True)):
        scene.now_ns += S
        scene.send("r1")
        scene.settle(lambda job, q=q: measured(q, 0.6))
        assert moments(sampler.look(scene.snapshot)) == ([("r1", "r2", q, 0.6)] if news else [])


def test_an_overlap_that_is_read_anew_is_told_each_minute() -> None:
    scene, sampler, told = Scene(), Sampler(), []
    scene.send("r1")
    for second in range(0, 130, 10):
        scene.now_ns = START_NS + second * S
        scene.send("r2")
        scene.settle(lambda job: measured(0.5, 0.6))
        told += [second for _ in moments(sampler.look(scene.snapshot))]
    assert told == [0, 60, 120]


def test_an_overlap_that_grows_too_old_is_told_as_unknown_once() -> None:
    scene, sampler = Scene(), Sampler()
    scene.send("r1")
    scene.send("r2")
    scene.settle()
    sampler.look(scene.snapshot)
    scene.wait(599)
    assert moments(sampler.look(scene.snapshot)) == []
    scene.wait(2)
    entries = sampler.look(scene.snapshot)
    assert moments(entries) == [("r1", "r2", None, None)]
    assert entries[0].found_by is FoundBy.UNKNOWN
    scene.wait(2)
    assert sampler.look(scene.snapshot) == []


def test_who_never_had_anything_in_common_is_no_news() -> None:
    scene, sampler = Scene(), Sampler()
    scene.send("r1")
    scene.send("r2", pose(0.0, BACK))
    scene.settle(lambda job: NOTHING)
    assert moments(sampler.look(scene.snapshot)) == []


def test_who_has_nothing_in_common_any_more_is_news_once() -> None:
    scene, sampler = Scene(), Sampler()
    scene.send("r1")
    scene.send("r2")
    scene.settle()
    assert len(moments(sampler.look(scene.snapshot))) == 1
    scene.now_ns += S
    scene.send("r2", pose(0.0, BACK))
    scene.settle(lambda job: NOTHING)
    assert moments(sampler.look(scene.snapshot)) == [("r1", "r2", 0.0, 0.0)]
    scene.wait(1)
    assert moments(sampler.look(scene.snapshot)) == []


def test_a_robot_that_is_forgotten_leaves_its_overlaps_unknown_and_comes_back_as_news() -> None:
    scene, sampler = Scene(), Sampler()
    scene.send("r1")
    scene.send("r2")
    scene.settle()
    sampler.look(scene.snapshot)
    scene.receive(ForgetRobot("r2"))
    scene.tick()
    assert moments(sampler.look(scene.snapshot)) == [("r1", "r2", None, None)]
    assert sampler.look(scene.snapshot) == []
    scene.send("r2")
    scene.settle()
    entries = sampler.look(scene.snapshot)
    assert points(entries) == [("r2", 0.0)]
    assert len(moments(entries)) == 1


def test_pairs_that_parted_are_forgotten_with_their_robots() -> None:
    scene, sampler = Scene(), Sampler()
    scene.send("r0")
    for number in range(1, 6):
        visitor = f"v{number}"
        scene.send(visitor)
        scene.settle()
        assert len(moments(sampler.look(scene.snapshot))) == 1
        # Back to back: their views cannot meet, and no record is kept.
        scene.now_ns += S
        scene.send(visitor, pose(1e3, BACK))
        scene.settle(lambda job: NOTHING)
        assert ("r0", visitor) not in scene.snapshot.records
        assert moments(sampler.look(scene.snapshot)) == [("r0", visitor, 0.0, 0.0)]
        scene.receive(ForgetRobot(visitor))
        scene.tick()
        assert moments(sampler.look(scene.snapshot)) == [("r0", visitor, None, None)]
        assert sampler.look(scene.snapshot) == []
        assert sampler._moments == {}


def test_the_same_snapshot_is_no_news() -> None:
    scene, sampler = Scene(), Sampler()
    for number in range(5):
        scene.send(f"r{number}", pose(0.3 * number))
    scene.settle()
    assert sampler.look(scene.snapshot)
    assert sampler.look(scene.snapshot) == []
