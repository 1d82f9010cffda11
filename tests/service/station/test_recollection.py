"""Whatever a memory holds, a station starts with it, and with nothing of it that makes no sense."""

from dataclasses import replace

import numpy as np
import pytest
from covista_service import answers
from covista_service.perception.camera import Camera, Pose
from covista_service.station.events import KeyframeId
from covista_service.station.memory import Memory, RememberedKeyframe, RememberedPair, RememberedRobot
from covista_service.station.recollection import sensible
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.memories import plain
from tests.service.station.remembering import remember
from tests.service.station.scenes import CAMERA, START_NS, S, Scene, measured, pose

IDS = st.sampled_from(["r1", "r2", "r3", "r4", "R 5", ""])
BOOTS = st.sampled_from(["b0", "b1"])
TIMES = st.one_of(
    st.integers(START_NS - 700 * S, START_NS + 5 * S), st.sampled_from([-(2**63), 0, 2**63 - 1, START_NS - 30 * S])
)
NUMBERS = st.one_of(st.floats(-5, 5), st.sampled_from([np.nan, np.inf, 1e300]))
SOUND_POSES = st.builds(pose, st.floats(-5, 5))
POSES = st.one_of(
    SOUND_POSES,
    st.builds(
        lambda turned, centre: Pose(np.array(turned).reshape(3, 3), np.array(centre)),
        st.lists(NUMBERS, min_size=9, max_size=9),
        st.lists(NUMBERS, min_size=3, max_size=3),
    ),
    st.just(Pose(np.eye(2), np.zeros(4))),
)
CAMERAS = st.sampled_from(
    [
        CAMERA,
        Camera(np.full((3, 3), np.nan), 320, 240),
        Camera(np.eye(2), 320, 240),
        replace(CAMERA, width=0),
        replace(CAMERA, coefficients=(1.0,)),
        replace(CAMERA, matrix=np.zeros((3, 3))),
    ]
)
KEYFRAME_IDS = st.builds(KeyframeId, IDS, BOOTS, st.integers(0, 3))
KEYFRAMES = st.one_of(
    st.builds(RememberedKeyframe, KEYFRAME_IDS, TIMES, TIMES, st.just(CAMERA), SOUND_POSES),
    st.builds(RememberedKeyframe, KEYFRAME_IDS, TIMES, TIMES, CAMERAS, POSES),
)
ROBOTS = st.builds(
    RememberedRobot,
    IDS,
    TIMES,
    st.none() | BOOTS,
    st.none() | POSES,
    TIMES,
    st.none() | KEYFRAMES,
    st.none() | TIMES,
)
SHARES = st.one_of(st.floats(0, 1), st.sampled_from([np.nan, -1.0, 2.0]))
PAIRS = st.builds(
    RememberedPair,
    st.tuples(IDS, IDS),
    st.tuples(SHARES, SHARES),
    TIMES,
    st.tuples(KEYFRAMES, KEYFRAMES),
    st.none() | st.tuples(st.tuples(SHARES, SHARES), st.tuples(SHARES, SHARES)),
    st.none() | st.tuples(TIMES, TIMES),
)


def known_pair(first: str, second: str) -> RememberedPair:
    """One that makes sense."""
    one, other = (
        RememberedKeyframe(KeyframeId(name, "b0", 0), START_NS, START_NS, CAMERA, pose()) for name in (first, second)
    )
    return RememberedPair((first, second), (0.5, 0.6), START_NS, (one, other))


MEMORIES = st.builds(
    Memory,
    st.lists(ROBOTS, max_size=6).map(tuple),
    st.lists(st.one_of(PAIRS, st.builds(known_pair, IDS, IDS)), max_size=6).map(tuple),
    st.frozensets(st.tuples(IDS, IDS), max_size=3),
    st.dictionaries(st.sampled_from(["g1", "g7", "g07", "g", "x", "g9999999"]), st.frozensets(IDS), max_size=4),
    st.integers(-1, 100),
    st.integers(-1, 100),
    st.integers(-1, 100),
)


@given(MEMORIES)
@settings(max_examples=150, deadline=None)
def test_a_station_starts_and_works_with_any_memory(memory: Memory) -> None:
    scene = Scene(memory=memory)
    for turn in range(3):
        told = scene.snapshot
        assert answers.robots_report(told).robots is not None
        assert answers.pairs_report(told).pairs is not None
        assert answers.groups_report(told).revision >= memory.revision
        assert answers.similarity_report(told).robots is not None
        assert all(int(group.label[1:]) <= told.groups.last_label for group in told.groups.groups)
        assert all(view.age_s is None or view.age_s >= 0 for view in told.pairs())
        assert np.isfinite(told.similarity.similarity).all()
        for number in range(turn * 2):
            scene.send(f"r{number + 1}", pose(0.1 * number))
        scene.settle(lambda job: measured())
        scene.wait(1)
    assert scene.snapshot.groups.last_label >= memory.label


@given(MEMORIES)
@settings(max_examples=150, deadline=None)
def test_what_makes_sense_does_so_again_and_is_what_a_station_remembers(memory: Memory) -> None:
    known = sensible(memory, START_NS)
    assert plain(sensible(known, START_NS)) == plain(known)
    again = remember(Scene(memory=memory).snapshot)
    same = {"robots": (), "revision": 0, "event": 0, "pairs": (), "unknown": frozenset()}
    assert plain(replace(again, **same)) == plain(replace(known, **same))
    assert {robot.id for robot in again.robots} == {robot.id for robot in known.robots}
    # Too old ones are unknown at once.
    assert {pair.pair for pair in again.pairs} <= {pair.pair for pair in known.pairs}


def robot(name: str = "r1", **details: object) -> RememberedRobot:
    return replace(RememberedRobot(name, START_NS, "b0", pose(), START_NS), **details)


def test_groups_hold_only_robots_that_are_known_and_stand_somewhere_each_once() -> None:
    members = {"g2": frozenset({"r1", "nobody"}), "g3": frozenset({"r1", "r2", "r3"}), "g4": frozenset({"r3"})}
    memory = Memory((robot(), robot("r2"), robot("r3", pose=None)), groups=members)
    known = sensible(memory, START_NS)
    assert known.groups == {"g2": {"r1"}, "g3": {"r2"}}
    assert known.label == 4


@pytest.mark.parametrize("label", ["g0", "g07", "", "h1", "g1 ", "g-1"])
def test_a_label_that_is_none_of_ours_is_not_shown(label: str) -> None:
    assert sensible(Memory((robot(),), groups={label: frozenset({"r1"})}), START_NS).groups == {}


def test_of_a_robot_that_is_there_twice_the_first_is_taken() -> None:
    known = sensible(Memory((robot(boot="b1"), robot(boot="b2"))), START_NS)
    assert [one.boot for one in known.robots] == ["b1"]


@pytest.mark.parametrize("x_m", [np.nan, np.inf, 1e12])
def test_a_robot_that_stood_nowhere_is_known_without_a_pose(x_m: float) -> None:
    (known,) = sensible(Memory((robot(pose=pose(x_m)),)), START_NS).robots
    assert known.pose is None
    assert known.boot == "b0"


def test_a_pair_of_which_one_robot_is_not_known_is_left_out() -> None:
    memory = Memory((robot(), robot("r2")), (known_pair("r1", "r2"), known_pair("r1", "r3"), known_pair("r2", "r1")))
    assert [pair.pair for pair in sensible(memory, START_NS).pairs] == [("r1", "r2")]


@pytest.mark.parametrize("overlaps", [(np.nan, 0.5), (0.5, 1.1), (-0.1, 0.5)])
def test_a_share_that_is_none_is_left_out(overlaps: tuple[float, float]) -> None:
    pair = replace(known_pair("r1", "r2"), overlaps=overlaps)
    assert sensible(Memory((robot(), robot("r2")), (pair,)), START_NS).pairs == ()


def test_an_interval_that_is_none_does_not_cost_the_overlap() -> None:
    pair = replace(known_pair("r1", "r2"), intervals=((0.1, 0.9), (0.9, 0.1)))
    (known,) = sensible(Memory((robot(), robot("r2")), (pair,)), START_NS).pairs
    assert known.overlaps == (0.5, 0.6)
    assert known.intervals is None


def test_what_is_of_a_time_to_come_is_of_now() -> None:
    later = START_NS + 3600 * S
    pair = replace(known_pair("r1", "r2"), computed_ns=later)
    known = sensible(Memory((robot(last_seen_ns=later), robot("r2")), (pair,)), START_NS)
    assert (known.robots[0].last_seen_ns, known.pairs[0].computed_ns) == (START_NS, START_NS)
