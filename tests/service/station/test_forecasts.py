"""Overlaps for new poses: read from known surfaces, without any image."""

from dataclasses import replace

import numpy as np
import pytest
from covista_schemas.reports import FoundBy
from covista_service.answers.pairs import common_regions, pair_report
from covista_service.perception.camera import Pose
from covista_service.perception.surface import flat
from covista_service.station.events import Tick
from covista_service.station.outlook import Outlook, stands
from covista_service.station.pairs import Answer, Pairs
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.perception.scenes import turn
from tests.service.station.scenes import BACK, NOTHING, SEEN, S, Scene, pose
from tests.service.station.test_pairs import ASIDE, names, pair

# Of a wall at four metres, each metre aside takes so much out of the image.
PER_M = 75 / 320
CELL = 1 / 48


def robots(count: int = 2, **options: object) -> Scene:
    """Robots in a row, a metre apart, that have seen the wall ahead of them."""
    scene = Scene.of(forget_after_s=5000, gone_after_s=5000, **options)
    for k in range(count):
        scene.send(f"r{k + 1}", pose(k))
    scene.settle(lambda job: SEEN)
    return scene


def away(x_m: float = 0.0) -> Pose:
    return pose(x_m, BACK)


def test_who_turns_away_shares_nothing_any_more_without_any_keyframe() -> None:
    scene = robots()
    assert pair(scene).found_by is FoundBy.IMAGE
    scene.send_pose("r1", away())
    scene.tick()
    view = pair(scene)
    assert (view.overlap_a, view.overlap_b, view.found_by, names(view)) == (0.0, 0.0, FoundBy.PREDICTED, (0, 0))
    assert scene.snapshot.similarity.overlap.tolist() == [[1, 0], [0, 1]]


@pytest.mark.parametrize("x_m", [-0.5, 0.3, 0.9, 1.5])
def test_an_overlap_follows_the_pose_as_a_keyframe_there_would_say(x_m: float) -> None:
    told, taken = robots(), robots()
    told.send_pose("r1", pose(x_m))
    told.tick()
    taken.send("r1", pose(x_m))
    taken.settle(lambda job: SEEN)
    forecast, measured = pair(told), pair(taken)
    assert forecast.overlap_a == pytest.approx(1 - PER_M * abs(1 - x_m), abs=CELL)
    assert forecast.overlap_a == pytest.approx(measured.overlap_a, abs=CELL)
    assert (forecast.found_by, measured.found_by) == (FoundBy.PREDICTED, FoundBy.IMAGE)


def test_both_stand_where_they_said_last() -> None:
    scene = robots()
    scene.send_pose("r1", pose(2))
    scene.send_pose("r2", pose(3))
    scene.tick()
    assert pair(scene).overlap_a == pytest.approx(1 - PER_M, abs=CELL)
    assert pair(scene).stands_for_ns == (scene.now_ns, scene.now_ns)


def test_an_answer_says_for_which_poses_it_stands() -> None:
    scene = robots()
    started_ns = scene.now_ns
    scene.now_ns += S
    scene.send_pose("r2", pose(1.5))
    scene.tick()
    report = pair_report(scene.snapshot, "r2", "r1")
    assert report.poses is not None
    assert (report.poses.a.timestamp(), report.poses.b.timestamp()) == (scene.now_ns / S, started_ns / S)
    assert report.keyframes is not None
    assert (report.keyframes.a.sequence, report.keyframes.b.sequence) == (0, 0)


def test_who_comes_back_is_answered_for_by_the_image_again() -> None:
    scene = robots()
    before = pair(scene)
    scene.send_pose("r1", away())
    scene.tick()
    scene.send_pose("r1", pose(0.001))
    scene.tick()
    after = pair(scene)
    assert (after.overlap_a, after.found_by, after.intervals) == (before.overlap_a, FoundBy.IMAGE, before.intervals)
    assert after.stands_for_ns == before.stands_for_ns


def test_a_motion_that_cannot_be_noticed_changes_nothing() -> None:
    scene = robots()
    before = scene.station.snapshot(scene.now_ns).records
    scene.send_pose("r1", pose(0.01, turn(0, 0.005, 0)))
    scene.tick()
    assert scene.snapshot.records["r1", "r2"] is before["r1", "r2"]
    assert scene.snapshot.workload.forecasts == 0


def test_a_drift_in_small_steps_is_noticed_once_it_adds_up() -> None:
    scene = robots()
    for step in range(1, 101):
        scene.send_pose("r1", pose(-0.01 * step))
        scene.tick()
    assert pair(scene).overlap_a == pytest.approx(1 - 2 * PER_M, abs=CELL + 0.02)


def test_poses_make_no_answer_younger_and_it_decays() -> None:
    scene = robots()
    started_ns = scene.now_ns
    for step in range(1, 140):
        scene.now_ns += 5 * S
        # There and back: by image, foretold, by image.
        scene.send_pose("r1", pose(0) if step % 2 else away())
        scene.tick()
        view, age_s = pair(scene), (scene.now_ns - started_ns) / S
        if age_s >= 600:
            assert view.found_by is FoundBy.UNKNOWN
        else:
            assert view.age_s == pytest.approx(age_s)
            assert (view.found_by is FoundBy.DECAYED) == (age_s >= 60)


def test_keyframes_without_surfaces_of_their_own_make_no_answer_younger() -> None:
    """Under overload surveys never come: what is inherited again and again grows old all the same."""
    scene = robots()
    started_ns = scene.now_ns
    for step in range(1, 70):
        scene.now_ns += 7 * S
        scene.send("r1", pose(0.01 * step))
        # The survey of the one before never ends: this one waits no longer.
        scene.wait(3)
        view, age_s = pair(scene), (scene.now_ns - started_ns) / S
        if age_s < 600:
            assert names(view) == (step, 0)
            assert view.age_s == pytest.approx(age_s)
            assert view.found_by is (FoundBy.DECAYED if age_s >= 60 else FoundBy.PREDICTED)
        else:
            assert view.found_by is FoundBy.UNKNOWN


def test_a_new_keyframe_inherits_the_surface_of_the_last_at_once() -> None:
    scene = robots()
    scene.send("r1", pose(0.5))
    surveys = scene.tick()
    view = pair(scene)
    assert (view.found_by, names(view)) == (FoundBy.PREDICTED, (1, 0))
    assert view.overlap_a == pytest.approx(1 - PER_M / 2, abs=CELL)
    assert view.outlooks is not None
    assert view.outlooks[0].points == 0
    scene.work(surveys, lambda job: SEEN)
    view = pair(scene)
    assert (view.found_by, names(view)) == (FoundBy.IMAGE, (1, 0))


def test_what_is_inherited_does_not_depend_on_how_many_keyframes_came_between() -> None:
    often, once = robots(), robots()
    for x_m in (0.1, -0.4, 0.9, 0.5):
        often.send("r1", pose(x_m))
        often.tick()
    once.send("r1", pose(0.5))
    once.tick()
    (mine, _), (its, _) = pair(often).outlooks or (), pair(once).outlooks or ()
    np.testing.assert_array_equal(mine.surface.inverse_depth, its.surface.inverse_depth)
    np.testing.assert_array_equal(mine.surface.sigma, its.surface.sigma)
    assert pair(often).overlap_a == pair(once).overlap_a


@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from("xyz"), st.integers(0, 20), st.booleans()), max_size=30)
)
def test_answers_expire_when_they_are_old_in_whatever_order_they_come(entered) -> None:
    scene, pairs, held = Scene(), Pairs(10 * S), {}
    for first, second, computed_s, parts in entered:
        keyframes = scene.keyframe(first), scene.keyframe(second)
        if parts:
            pairs.part((first, second))
            held.pop((first, second), None)
        else:
            pairs.enter((first, second), Answer((0.5, 0.5), FoundBy.PREDICTED, computed_s * S, *keyframes))
            held[first, second] = computed_s
    for now_s in range(0, 40, 3):
        old = {pair for pair, computed_s in held.items() if now_s - computed_s >= 10}
        assert set(pairs.expire(now_s * S)) == old
        held = {pair: computed_s for pair, computed_s in held.items() if pair not in old}


def test_who_turns_far_meets_others_than_before_without_any_keyframe() -> None:
    """r1 looks at one wall with r2, and turns to where r3 looks with r4."""
    scene = robots()
    for k, robot in ((0, "r3"), (1, "r4")):
        scene.send(robot, pose(k, BACK))
    scene.settle(lambda job: SEEN)
    assert (pair(scene, "r1", "r3").overlap_a, pair(scene, "r1", "r2").overlap_a) == (0.0, ASIDE)
    scene.send_pose("r1", away())
    scene.tick()
    assert pair(scene, "r1", "r2").overlap_a == 0
    assert pair(scene, "r1", "r3").overlap_a == pytest.approx(1, abs=CELL)
    scene.send_pose("r1", pose(0))
    scene.tick()
    assert pair(scene, "r1", "r2").overlap_a == ASIDE
    assert pair(scene, "r1", "r3").overlap_a == 0
    assert scene.snapshot.similarity.overlap[0, 2] == 0


def test_the_common_field_is_drawn_where_the_keyframes_were_taken() -> None:
    scene = robots()
    before = [[region.tolist() for region in side] for side in common_regions(pair(scene))]
    scene.send_pose("r1", away())
    scene.tick()
    assert pair(scene).overlap_a == 0
    assert [[region.tolist() for region in side] for side in common_regions(pair(scene))] == before


def test_a_change_by_motion_is_not_smoothed() -> None:
    scene = robots()
    smoothing = scene.options.grouping.smoothing
    assert smoothing < 1
    scene.send_pose("r1", away())
    scene.tick()
    assert scene.station._groups._affinity.mutual[0, 1] == 0
    scene.send_pose("r1", pose(0))
    scene.tick()
    assert scene.station._groups._affinity.mutual[0, 1] == pytest.approx(pair(scene).overlap_a, abs=1e-9)


def test_more_than_is_allowed_waits_and_nothing_is_forgotten() -> None:
    scene = robots(6, forecasts_per_s=40)
    scene.now_ns += S
    for k in range(6):
        scene.send_pose(f"r{k + 1}", pose(k + 0.5))
    scene.tick()
    first = scene.snapshot.workload
    # A quarter of a second's worth is there at once.
    assert first.forecasts == 10
    assert first.forecasts_waiting > 0
    assert scene.station.waits
    ticks = 0
    while scene.station.waits:
        scene.wait(0.05)
        ticks += 1
        assert ticks < 40
    assert scene.snapshot.workload.forecasts == 30
    for k in range(1, 6):
        assert pair(scene, f"r{k}", f"r{k + 1}").stands_for_ns[0] > pair(robots()).stands_for_ns[0]


def test_who_moves_all_the_time_starves_nobody() -> None:
    scene = robots(8, forecasts_per_s=100)
    scene.now_ns += S
    told_ns = scene.now_ns
    scene.send_pose("r8", pose(7.5))
    served_ns = None
    for step in range(200):
        for k in range(7):
            scene.send_pose(f"r{k + 1}", pose(k + 0.3 * np.sin(step + k)))
        scene.tick()
        if served_ns is None and all(
            view.stands_for_ns[1] == told_ns for k in range(7) if (view := pair(scene, f"r{k + 1}", "r8"))
        ):
            served_ns = scene.now_ns
        scene.now_ns += S // 50
    # Eight robots with seven pairs each, at a hundred ordered pairs a second.
    assert served_ns is not None
    assert served_ns - told_ns <= 1.3 * S


@pytest.mark.parametrize("per_s", [20, 60, 1000])
def test_never_more_than_allowed(per_s: int) -> None:
    scene = robots(6, forecasts_per_s=per_s)
    began_ns = scene.now_ns
    for step in range(100):
        for k in range(6):
            scene.send_pose(f"r{k + 1}", pose(k + 0.3 * np.sin(step + k)))
        scene.wait(0.02)
        spent_s = (scene.now_ns - began_ns) / S
        assert scene.snapshot.workload.forecasts <= per_s * (spent_s + 0.25) + 2


def test_with_none_allowed_an_answer_stands_as_it_was() -> None:
    scene = robots(forecasts_per_s=0)
    scene.send_pose("r1", away())
    scene.tick()
    assert pair(scene).found_by is FoundBy.IMAGE
    assert not scene.station.waits


def test_a_turn_is_bounded_however_many_partners_a_robot_has() -> None:
    scene = robots(20, forecasts_per_s=1e6)
    scene.now_ns += S
    for k in range(20):
        scene.send_pose(f"r{k + 1}", pose(k + 0.5))
    before = 0
    while True:
        scene.receive(Tick())
        done = scene.snapshot.workload.forecasts
        assert done - before <= 256
        if not scene.station.waits:
            break
        before = done
        scene.now_ns += S // 50
    assert done >= 256


def test_a_clock_that_is_set_back_stops_nothing() -> None:
    scene = robots()
    scene.now_ns -= 1000 * S
    for step in range(5):
        scene.send_pose("r1", pose(0.5 + step / 4), time_ns=scene.now_ns + 2000 * S + step)
        scene.wait(0.1)
    assert pair(scene).overlap_a == pytest.approx(1 - PER_M / 2, abs=CELL)


def test_a_robot_that_is_forgotten_while_it_waits_is_gone() -> None:
    scene = robots(4, forecasts_per_s=8)
    for k in range(4):
        scene.send_pose(f"r{k + 1}", pose(k + 0.5))
    scene.tick()
    scene.station._forget("r2")
    for _ in range(20):
        scene.wait(0.5)
    assert not scene.station.waits
    assert "r2" not in scene.snapshot.robots
    assert not any("r2" in one for one in scene.snapshot.records)


def test_a_correction_moves_along() -> None:
    """P_now' = P_settled P_reported^-1 P_now."""
    keyframe = Scene().keyframe("r1", Pose(turn(0.1, 0.2, 0.3), np.array([1.0, 2.0, 3.0])))
    settled = Pose(turn(0.12, 0.25, 0.28), np.array([1.1, 1.9, 3.2]))
    outlook = Outlook(keyframe, settled, flat(0.25), 9, {}, (4.0, 4.0, 4.0))
    now = Pose(turn(0.4, -0.2, 0.1), np.array([2.0, 1.0, 5.0]))

    def matrix(at: Pose) -> np.ndarray:
        return np.block([[at.world_from_camera, at.centre_m[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])

    expected = matrix(settled) @ np.linalg.inv(matrix(keyframe.pose)) @ matrix(now)
    np.testing.assert_allclose(matrix(stands(outlook, now)), expected, atol=1e-12)
    np.testing.assert_allclose(matrix(stands(outlook, keyframe.pose)), matrix(settled), atol=1e-12)
    assert stands(replace(outlook, pose=keyframe.pose), now) is now


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["pose", "keyframe", "work", "wait"]),
            st.integers(1, 4),
            st.tuples(*[st.floats(-40, 40)] * 3),
            st.tuples(*[st.floats(-3.2, 3.2)] * 3),
        ),
        max_size=25,
    )
)
@settings(max_examples=30, deadline=None)
def test_whatever_robots_do_shares_are_shares(steps) -> None:
    scene = robots(4)
    for kind, robot, centre_m, angles in steps:
        at = Pose(turn(*angles), np.array(centre_m))
        if kind == "pose":
            scene.send_pose(f"r{robot}", at)
        elif kind == "keyframe":
            scene.send(f"r{robot}", at)
        elif kind == "work":
            scene.settle(lambda job: NOTHING)
        else:
            scene.wait(abs(centre_m[0]))
    scene.tick()
    for view in scene.snapshot.pairs():
        for share in (view.overlap_a, view.overlap_b):
            assert share is None or 0 <= share <= 1
        for low, high in view.intervals or ():
            assert 0 <= low <= high <= 1
    overlap = scene.snapshot.similarity.overlap
    assert ((overlap >= 0) & (overlap <= 1) | np.isnan(overlap)).all()
