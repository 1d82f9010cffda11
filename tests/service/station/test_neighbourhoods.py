"""Judged among those near it, a robot has the partners that a look at everybody would give it; and of all other pairs
the station answers the same as ever, though it keeps nothing of them."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from covista_schemas.reports import FoundBy
from covista_service.perception.camera import Pose
from covista_service.perception.surface import flat
from covista_service.station.events import InterruptedTickError, SurveyPair
from covista_service.station.horizon import Horizon
from covista_service.station.outlook import Outlook
from covista_service.station.pairs import pair_of
from covista_service.station.reach import Reach
from covista_service.station.station import Station
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.scenes import AHEAD, BACK, NOTHING, S, Scene, measured, pose, surveys

places = st.tuples(st.integers(0, 9), st.floats(0, 60), st.floats(0, 60), st.floats(-np.pi, np.pi), st.booleans())


def facing(x_m: float, z_m: float, yaw: float) -> Pose:
    cos, sin = np.cos(yaw), np.sin(yaw)
    return Pose(np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]), np.array([x_m, 0.0, z_m]))


def partners(station: Station, robot: str) -> set[str]:
    return set(station._surveys._agenda.partners(robot))


@given(st.lists(places, max_size=30))
@settings(max_examples=40, deadline=None)
def test_partners_are_those_that_a_look_at_all_pairs_gives(steps) -> None:
    scene = Scene.of(capacity=1, retry_after_s=1e6)
    hoods, names = scene.station._surveys.neighbourhoods, set()
    for number, x_m, z_m, yaw, deep in steps:
        name = f"r{number}"
        names.add(name)
        scene.send(name, facing(x_m, z_m, yaw))
        scene.tick()
        robot = scene.station._roster[name]
        if deep:
            depths = (2.0, 4.0, 1.0 + z_m / 10)
            hoods.deepen(robot, Outlook(robot.keyframe, robot.keyframe.pose, flat(0.25), 20, {}, depths))
            scene.tick()
    reaches = hoods._reaches
    assert set(reaches) == names
    for a, b in combinations(sorted(names), 2):
        meet = reaches[a].frustum.may_meet(reaches[b].frustum)
        assert (b in partners(scene.station, a)) == (a in partners(scene.station, b)) == meet
        assert ((a, b) in scene.snapshot.records) == meet


def two_sides(ahead: int = 3, back: int = 3, **options: object) -> Scene:
    """Robots of which some look ahead and some back, all having seen their wall."""
    scene = Scene.of(**options)
    for number in range(ahead):
        scene.send(f"a{number}", pose(number, AHEAD))
    scene.settle()
    for number in range(back):
        scene.send(f"b{number}", pose(number, BACK))
    scene.settle(lambda job: measured() if job.first.robot[0] == job.second.robot[0] else NOTHING)
    return scene


def test_of_pairs_that_share_nothing_nothing_is_kept() -> None:
    scene = two_sides()
    kept = {pair for pair in scene.snapshot.records if pair[0][0] != pair[1][0]}
    assert kept == set()
    for a, b in (("a0", "b2"), ("b2", "a0")):
        view = scene.snapshot.pair(a, b)
        assert (view.overlap_a, view.overlap_b, view.found_by) == (0.0, 0.0, FoundBy.PREDICTED)
        assert (view.keyframe_a.id, view.keyframe_b.id) == tuple(
            scene.snapshot.robots[name].keyframe for name in ("a0", "b2")
        )
    similarity = scene.snapshot.similarity
    row = similarity.overlap[similarity.robots.index("a0")]
    assert row.tolist()[3:] == [0.0, 0.0, 0.0]


def test_an_answer_about_who_shares_nothing_ages_like_any_other() -> None:
    scene = two_sides(forget_after_s=5000, gone_after_s=5000)
    scene.wait(10)
    scene.send("a0", pose(0, AHEAD))
    scene.settle(lambda job: NOTHING if job.first.robot[0] != job.second.robot[0] else measured())
    assert scene.snapshot.pair("a0", "b0").age_s == 0
    assert scene.snapshot.pair("a1", "b0").age_s == 10
    scene.wait(50)
    assert scene.snapshot.pair("a1", "b0").found_by is FoundBy.DECAYED
    assert scene.snapshot.pair("a0", "b0").found_by is FoundBy.PREDICTED
    scene.wait(540)
    assert scene.snapshot.pair("a1", "b0").found_by is FoundBy.UNKNOWN
    assert scene.snapshot.pair("a0", "b0").found_by is FoundBy.DECAYED
    similarity = scene.snapshot.similarity
    unknown = np.isnan(similarity.overlap[3:, :3]).tolist()
    assert unknown == [[False, True, True]] * 3
    scene.wait(10)
    assert scene.snapshot.pair("a0", "b0").found_by is FoundBy.UNKNOWN
    assert np.isnan(scene.snapshot.similarity.overlap[3:, :3]).all()


def test_a_keyframe_after_all_was_unknown_says_again_that_nothing_is_shared() -> None:
    scene = two_sides(forget_after_s=5000, gone_after_s=5000, retry_after_s=1e6)
    scene.wait(700)
    scene.send("a0", pose(0, AHEAD))
    scene.tick()
    similarity = scene.snapshot.similarity
    assert similarity.overlap[0, 3:].tolist() == [0.0, 0.0, 0.0]
    assert np.isnan(similarity.overlap[1:3, 3:]).all()
    assert scene.snapshot.pair("a0", "b1").found_by is FoundBy.PREDICTED


def mutual(scene: Scene, a: str, b: str) -> float:
    affinity = scene.station._groups._affinity
    robots = affinity.robots
    return float(affinity.mutual[robots.index(a), robots.index(b)])


def test_what_has_parted_comes_down_to_nothing_with_further_keyframes() -> None:
    scene = Scene.of(retry_after_s=1e6, gone_after_s=1000)
    for name in ("r1", "r2", "r3"):
        scene.send(name, pose(0, AHEAD))
    scene.settle()
    before = mutual(scene, "r1", "r2")
    held = [before]
    for number in range(60):
        scene.wait(1)
        scene.send("r2", pose(0.01 * number, BACK))
        scene.settle(lambda job: NOTHING)
        held.append(mutual(scene, "r1", "r2"))
    assert before > 0.5
    assert all(later <= sooner for sooner, later in pairwise(held))
    assert held[4] < 0.5 * before
    assert held[-1] < 1e-3
    assert scene.station._surveys.neighbourhoods._receding == {}
    assert scene.snapshot.pair("r1", "r2").overlap_a == 0.0


def test_a_robot_that_comes_back_shares_with_everybody_what_it_did() -> None:
    scene = two_sides()
    for _ in range(8):
        scene.wait(5)
        for name in ("a1", "a2", "b0", "b1", "b2"):
            scene.send_pose(name, pose(int(name[1]), AHEAD if name[0] == "a" else BACK))
    assert scene.snapshot.robots["a0"].group is None
    scene.send_pose("a0", pose(0, AHEAD))
    scene.tick()
    similarity = scene.snapshot.similarity
    assert similarity.robots[0] == "a0"
    assert similarity.overlap[0, 3:].tolist() == [0.0, 0.0, 0.0]
    assert (similarity.overlap[0, :3] > 0).all()


def test_a_forgotten_robot_leaves_nothing_behind() -> None:
    scene = two_sides(retry_after_s=0.0)
    scene.send("b0", pose(0, AHEAD))
    scene.settle(lambda job: NOTHING)
    scene.send_pose("b1", pose(0, AHEAD))
    scene.tick()
    assert scene.station._surveys.neighbourhoods._standing
    scene.wait(700)
    station = scene.station
    hoods, agenda = station._surveys.neighbourhoods, station._surveys._agenda
    assert list(scene.snapshot.robots) == []
    assert [hoods._reaches, hoods._judged, hoods._ageing, hoods._lapsed, hoods._receding, hoods._to_judge] == 6 * [{}]
    assert hoods._later == {}
    assert (hoods._standing, len(hoods._ground)) == ({}, 0)
    assert (len(hoods._grid), hoods._horizon._far_m) == (0, {})
    assert (agenda._partners, agenda._fresh, agenda._moved, len(agenda._regular)) == ({}, {}, {}, 0)
    assert (agenda._patrol._slot, agenda._patrol._names, agenda._parked) == ({}, [], set())
    assert (station._pairs._records, station._pairs._beside) == ({}, {})
    assert station._views == {}


def test_views_of_unknown_depth_reach_as_far_as_is_usual_once_enough_is_known() -> None:
    horizon = Horizon()
    told = [horizon.note(f"r{k}", 10.0 + k) for k in range(8)]
    assert told == [False] * 7 + [True]
    assert horizon.farthest_m == pytest.approx(13.5)
    for k in range(8, 40):
        assert not horizon.note(f"r{k}", 100.0)
    assert horizon.farthest_m == 100.0
    horizon.forget("r0")
    assert not horizon.note("r1", 1.0)


def test_who_was_judged_before_anything_was_known_is_judged_again() -> None:
    """A robot far behind, that looks at the others' backs, may see them only as long as views are endless."""
    scene = Scene.of(retry_after_s=1e6, capacity=1)
    hoods = scene.station._surveys.neighbourhoods
    scene.send("far", pose(0, AHEAD))
    scene.tick()
    for number in range(8):
        scene.send(f"r{number}", Pose(AHEAD, np.array([0.1 * number, 0.0, 500.0])))
    scene.tick()
    assert len(partners(scene.station, "far")) == 8
    for number in range(8):
        robot = scene.station._roster[f"r{number}"]
        hoods.deepen(robot, Outlook(robot.keyframe, robot.keyframe.pose, flat(0.25), 20, {}, (3.0, 4.0, 5.0)))
    scene.tick()
    assert partners(scene.station, "far") == set()
    assert len(partners(scene.station, "r0")) == 7


def test_who_may_be_met_from_another_pose_can_be_asked() -> None:
    scene = two_sides()
    hoods = scene.station._surveys.neighbourhoods
    assert sorted(hoods.beside("a0", pose(0, AHEAD))) == ["a1", "a2"]
    assert hoods.beside("a0", None) == []
    assert sorted(hoods.beside("a0", pose(0, BACK))) == ["b0", "b1", "b2"]
    assert hoods.beside("nobody", pose(0)) == []


@pytest.mark.parametrize("count", [30, 120])
def test_records_and_partners_follow_neighbours_and_not_the_size_of_the_swarm(count: int) -> None:
    scene = Scene.of(capacity=1, retry_after_s=1.0)
    for number in range(count):
        scene.send(f"r{number:03}", pose(3.0 * number, AHEAD))
    for number in range(count):
        robot = scene.station._roster[f"r{number:03}"]
        outlook = Outlook(robot.keyframe, robot.keyframe.pose, flat(0.25), 20, {}, (3.0, 4.0, 5.0))
        scene.station._surveys.neighbourhoods.deepen(robot, outlook)
    # All kinds of surveys, of which none finds anything.
    for _ in range(3):
        scene.work(scene.wait(2), lambda job: NOTHING)
    records = scene.snapshot.records
    assert set(records) == {
        pair_of(name, other) for name in scene.snapshot.robots for other in partners(scene.station, name)
    }
    assert len(records) < 8 * count
    assert scene.snapshot.workload.started["sweep"] > 0


def test_surveys_of_a_keyframe_are_no_more_in_a_larger_swarm() -> None:
    def surveys_of_one(count: int) -> int:
        scene = Scene.of(capacity=4, retry_after_s=1e6)
        for number in range(count):
            scene.send(f"r{number:03}", pose(6.0 * number, AHEAD))
            robot = scene.station._roster[f"r{number:03}"]
            outlook = Outlook(robot.keyframe, robot.keyframe.pose, flat(0.25), 20, {}, (3.0, 4.0, 5.0))
            scene.station._surveys.neighbourhoods.deepen(robot, outlook)
        for _ in range(count):
            scene.work(scene.wait(1), lambda job: NOTHING)
        scene.send("r010", pose(60.0, AHEAD))
        return len([pair for pair in surveys(scene.settle(lambda job: NOTHING)) if pair in scene.snapshot.records])

    assert surveys_of_one(20) == surveys_of_one(60) > 0


def astray(count: int = 2) -> Scene:
    """Robots whose poses say that two sides look apart, and whose images all show the same; each has its keyframe."""
    scene = Scene.of(capacity=4, retry_after_s=1.0, gone_after_s=1000)
    for number in range(count):
        scene.send(f"a{number}", pose(number, AHEAD))
        scene.send(f"b{number}", pose(number, BACK))
    return scene


def across(scene: Scene) -> set[tuple[str, str]]:
    return {pair for pair in scene.snapshot.records if pair[0][0] != pair[1][0]}


def test_what_images_have_found_in_common_is_kept_until_images_say_otherwise() -> None:
    scene = astray()
    scene.settle()
    for _ in range(3):
        scene.work(scene.wait(1))
    everyone = {(f"a{i}", f"b{k}") for i in range(2) for k in range(2)}
    assert across(scene) == everyone
    for _ in range(4):
        scene.now_ns += S
        for number in range(2):
            scene.send(f"a{number}", pose(number, AHEAD))
            scene.send(f"b{number}", pose(number, BACK))
        # First surfaces come from other pairs, and those across have a turn in which workers fail.
        scene.settle(lambda job: measured() if job.first.robot[0] == job.second.robot[0] else None)
        assert across(scene) == everyone
    scene.now_ns += S
    for number in range(2):
        scene.send(f"a{number}", pose(number, AHEAD))
    scene.settle(lambda job: measured() if job.first.robot[0] == job.second.robot[0] else NOTHING)
    assert across(scene) == set()


@pytest.mark.parametrize("found", [True, False])
def test_a_survey_whose_keyframe_was_replaced_meanwhile_counts_as_it_came_out(found: bool) -> None:
    scene = Scene.of(capacity=1, retry_after_s=1.0)
    scene.send("a0", pose(0, AHEAD))
    scene.send("b0", facing(0, -50, np.pi))
    (sweep,) = [job for job in scene.tick() if isinstance(job, SurveyPair)]
    for _ in range(2):
        # It waits for two seconds at most.
        scene.send("a0", pose(0, AHEAD))
        scene.wait(3)
    assert scene.snapshot.robots["a0"].keyframe != sweep.first
    scene.done(sweep, measured() if found else NOTHING)
    assert (("a0", "b0") in scene.snapshot.records) is found
    assert ("b0" in partners(scene.station, "a0")) is found


def test_what_the_sweep_has_found_shares_nothing_as_before_until_surfaces_tell() -> None:
    scene = Scene.of(capacity=1, retry_after_s=1.0)
    scene.send("a0", pose(0, AHEAD))
    scene.send("b0", facing(0, -50, np.pi))
    (sweep,) = [job for job in scene.tick() if isinstance(job, SurveyPair)]
    before = scene.snapshot.pair("a0", "b0")
    assert (before.overlap_a, before.found_by) == (0.0, FoundBy.PREDICTED)
    scene.done(sweep, measured())
    after = scene.snapshot.pair("a0", "b0")
    assert (after.overlap_a, after.found_by, after.age_s) == (0.0, FoundBy.PREDICTED, before.age_s)
    assert after.keyframe_a is before.keyframe_a
    scene.tick()
    assert scene.snapshot.pair("a0", "b0").found_by is FoundBy.IMAGE


def test_whoever_cannot_be_judged_costs_nobody_else_a_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = two_sides()
    hoods = scene.station._surveys.neighbourhoods

    def broken(keyframe, *known):
        if keyframe.id.robot == "b0":
            raise ZeroDivisionError
        return of(keyframe, *known)

    of = Reach.of
    monkeypatch.setattr(Reach, "of", broken)
    for name in ("a0", "b0", "c0", "c1"):
        scene.send(name, pose(1, AHEAD))
    with pytest.raises(InterruptedTickError):
        scene.tick()
    scene.settle(lambda job: NOTHING)
    assert {"a0", "c0", "c1"} <= set(hoods._reaches)
    assert hoods._to_judge == {}
    assert "c1" in partners(scene.station, "c0")


def test_what_a_survey_says_of_a_robot_that_could_not_be_judged_is_survived() -> None:
    scene = two_sides()
    hoods = scene.station._surveys.neighbourhoods
    hoods._reaches.pop("b0")
    hoods.look_over(("a0", "b0"))
    assert ("a0", "b0") not in scene.snapshot.records


def test_the_matrix_knows_what_the_answers_know() -> None:
    scene = two_sides(forget_after_s=5000, gone_after_s=5000, retry_after_s=1e6)

    def agree() -> None:
        similarity, snapshot = scene.snapshot.similarity, scene.snapshot
        for (i, a), (k, b) in combinations(enumerate(similarity.robots), 2):
            view, shared = snapshot.pair(a, b), similarity.overlap[i, k]
            assert view.overlap_a == (None if np.isnan(shared) else pytest.approx(shared)), (a, b)

    agree()
    scene.wait(700)
    agree()
    # Two that had lapsed may meet now, and two others have parted.
    for name, at in (("b0", AHEAD), ("a1", BACK)):
        scene.send(name, pose(int(name[1]), at))
    scene.tick()
    agree()
    assert scene.snapshot.pair("a0", "b0").found_by is FoundBy.UNKNOWN
    scene.wait(1)
    agree()
