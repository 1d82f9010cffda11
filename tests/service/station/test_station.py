"""The station as a whole: the same events give the same effects, and what is read stays as it was read."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from covista_service.station.events import BuildSurfaces, Effect, ExtractFeatures, GroupsEvaluated, SurveyPair, Tick
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.scenes import NOTHING, START_NS, Scene, measured, pose

STEPS = st.lists(
    st.tuples(
        st.sampled_from(["keyframe", "image", "pose", "work", "wait"]),
        st.integers(0, 7),
        st.floats(0, 3),
        st.booleans(),
    ),
    max_size=40,
)


def described(effect: Effect) -> object:
    match effect:
        case ExtractFeatures(keyframe):
            return ("extract", keyframe.id)
        case SurveyPair():
            return ("survey", effect.first, effect.second)
        case BuildSurfaces():
            return ("build", effect.keyframes)
        case _:
            return effect


def play(steps) -> tuple[list[object], Scene]:
    scene, pending = Scene(), []
    for kind, robot, x_m, good in steps:
        name = f"r{robot}"
        if kind in ("keyframe", "image"):
            pending += scene.send(name, pose(x_m), image=kind == "image")
        elif kind == "pose":
            scene.send_pose(name, pose(x_m))
        elif kind == "work":
            scene.work(pending, lambda job, good=good: measured() if good else NOTHING)
            pending = []
        else:
            pending += scene.wait(10 * x_m)
    return [described(effect) for effect in scene.told], scene


@given(STEPS)
@settings(max_examples=40, deadline=None)
def test_the_same_events_give_the_same_effects(steps) -> None:
    (told, first), (again, second) = play(steps), play(steps)
    assert told == again
    assert first.snapshot.groups == second.snapshot.groups
    np.testing.assert_array_equal(first.snapshot.similarity.similarity, second.snapshot.similarity.similarity)


@given(STEPS)
@settings(max_examples=40, deadline=None)
def test_every_known_robot_stands_in_one_group_or_is_ungrouped(steps) -> None:
    _, scene = play(steps)
    scene.settle()
    view = scene.snapshot
    standing = [robot for group in view.groups.groups for robot in group.robots]
    standing += [robot for robot, _ in view.groups.ungrouped]
    assert sorted(standing) == sorted(view.robots)
    assert {robot: held.group for robot, held in view.robots.items()} == {
        robot: group.label if (group := view.group_of(robot)) else None for robot in view.robots
    }
    grouped = [robot for group in view.groups.groups for robot in group.robots]
    assert sorted(grouped) == list(view.similarity.robots)


@given(STEPS)
@settings(max_examples=20, deadline=None)
def test_no_nan_is_told_of_a_pair(steps) -> None:
    _, scene = play(steps)
    for pair in scene.snapshot.pairs():
        assert (pair.overlap_a is None) == (pair.overlap_b is None) == (pair.age_s is None)
        assert pair.overlap_a is None or 0 <= pair.overlap_a <= 1


def test_an_empty_station_has_nothing_to_tell() -> None:
    scene = Scene()
    assert scene.tick() == []
    view = scene.snapshot
    assert (dict(view.robots), view.groups.groups, view.groups.revision) == ({}, (), 0)


def test_a_snapshot_stays_as_it_was() -> None:
    scene = Scene()
    scene.send("r1")
    before = scene.snapshot
    scene.send("r2")
    scene.settle()
    assert list(before.robots) == ["r1"]
    assert before.groups.revision == 0
    assert dict(before.records) == {}
    with pytest.raises(FrozenInstanceError):
        before.now_ns = 0


def test_a_snapshot_is_made_once_while_nothing_changes() -> None:
    scene = Scene()
    scene.send("r1")
    scene.send("r2")
    scene.settle()
    before = scene.snapshot
    scene.wait(1)
    after = scene.snapshot
    assert after.robots is before.robots
    assert after.records is before.records
    assert after.now_ns == before.now_ns + 1_000_000_000


def test_a_tick_has_nothing_to_say_twice() -> None:
    scene = Scene()
    for robot in ("r1", "r2", "r3"):
        scene.send(robot)
    scene.settle()
    assert scene.station.receive(Tick(), scene.now_ns) == []


def test_a_robot_alone_is_never_evaluated_with_a_survey() -> None:
    scene = Scene()
    scene.send("r1")
    assert not any(isinstance(effect, GroupsEvaluated) for effect in scene.settle())
    assert scene.snapshot.robots["r1"].last_seen_ns == START_NS
