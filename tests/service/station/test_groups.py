"""Who belongs together, as the station tells it."""

import numpy as np
import pytest
from covista_service.grouping.hysteresis import HysteresisOptions
from covista_service.station.events import GroupsChanged
from covista_service.station.options import GroupingOptions

from tests.service.station.scenes import Scene, happenings, measured, pose


def changes(effects) -> list[GroupsChanged]:
    return [effect for effect in effects if isinstance(effect, GroupsChanged)]


def groups(scene: Scene) -> dict[str, tuple[str, ...]]:
    return {group.label: group.robots for group in scene.snapshot.groups.groups}


def share(job):
    """Robots of one letter see the same, others nothing."""
    return measured(0.9, 0.9) if job.first.robot[0] == job.second.robot[0] else measured(0.0, 0.0)


def two_groups(**options: object) -> Scene:
    scene = Scene.of(**options)
    for number, robot in enumerate(("a1", "a2", "a3")):
        scene.send(robot, pose(0.1 * number))
    for number, robot in enumerate(("b1", "b2", "b3")):
        scene.send(robot, pose(20 + 0.1 * number))
    scene.settle(share)
    return scene


def test_robots_that_see_the_same_stand_together() -> None:
    scene = two_groups()
    assert sorted(groups(scene).values()) == [("a1", "a2", "a3"), ("b1", "b2", "b3")]
    view = scene.snapshot
    assert view.robots["a2"].group == view.robots["a1"].group != view.robots["b1"].group
    assert view.group_of("nobody") is None
    for robot in view.robots:
        assert view.group_of(robot) == next(group for group in view.groups.groups if robot in group.robots)
    assert [m for m, _ in view.groups.scores] == [1, 2, 3, 4, 5, 6]


def test_a_revision_comes_only_when_someone_stands_elsewhere() -> None:
    scene = two_groups()
    before = scene.snapshot
    scene.send("a1", pose(0.05))
    assert changes(scene.settle(share)) == []
    assert scene.snapshot.groups.revision == before.groups.revision
    assert scene.snapshot.similarity.revision > before.similarity.revision
    scene.send("c1", pose(0.1))
    (change, *_) = changes(scene.settle(share))
    assert change.revision == before.groups.revision + 1
    assert scene.snapshot.groups.time_ns == scene.now_ns


def test_those_are_told_whose_own_group_is_another() -> None:
    scene = two_groups()
    label = scene.snapshot.robots["a1"].group
    for _ in range(8):
        for robot in ("a1", "a2", "b1", "b2", "b3"):
            scene.send_pose(robot, pose(0.0 if robot[0] == "a" else 20.0))
        effects = scene.wait(4.9)
        if changes(effects):
            break
    (change,) = changes(effects)
    assert change.robots == ("a1", "a2", "a3")
    assert ("leave", f"a3 left {label}") in happenings(effects)
    assert groups(scene)[label] == ("a1", "a2")


def test_happenings_name_revisions_robots_and_labels() -> None:
    scene = Scene()
    scene.send("r1")
    scene.tick()
    assert happenings(scene.told) == [("status", "r1 is live"), ("groups", "g1: r1"), ("join", "r1 joined g1")]
    whole = scene.told[-2]
    assert (whole.revision_before, whole.revision_after, whole.labels, whole.robots) == (0, 1, ("g1",), ("r1",))


def test_poses_regroup_a_few_times_a_second_and_a_new_keyframe_within_20_ms() -> None:
    scene = two_groups(regroup_after_s=0.1)
    scene.wait(0.1)
    revision = scene.snapshot.similarity.revision
    for _ in range(20):
        scene.send_pose("a1", pose(0.1))
        scene.wait(0.01)
    assert scene.snapshot.similarity.revision == revision + 2
    scene.send("a1", pose(0.1))
    scene.work(scene.tick(), share)
    scene.wait(0.02)
    assert scene.snapshot.similarity.revision == revision + 3
    scene.send_pose("a1", pose(0.1))
    scene.wait(-3600)
    scene.wait(0.1)
    assert scene.snapshot.similarity.revision == revision + 4


def test_a_pose_alone_can_regroup() -> None:
    scene = two_groups()
    scene.station.set_grouping(GroupingOptions(alpha=0.0))
    scene.tick()
    scene.send_pose("a1", pose(20.0))
    scene.wait(0.2)
    assert ("a1", "b1", "b2", "b3") in groups(scene).values()


def test_live_settings_hold_from_the_next_tick() -> None:
    scene = two_groups()
    scene.station.set_grouping(GroupingOptions(groups=1))
    assert len(groups(scene)) == 2
    told = happenings(scene.tick())
    assert [kind for kind, _ in told] == ["groups", "merge"]
    assert list(groups(scene)) == ["g1"]
    assert scene.snapshot.groups.settings.groups == 1


def test_a_fixed_number_beyond_the_robots_is_as_many_as_there_are() -> None:
    scene = two_groups()
    scene.station.set_grouping(GroupingOptions(groups=9))
    scene.tick()
    assert len(groups(scene)) == 6


def test_the_matrix_is_that_of_the_last_evaluation_and_cannot_be_written() -> None:
    view = two_groups().snapshot.similarity
    assert view.robots == ("a1", "a2", "a3", "b1", "b2", "b3")
    np.testing.assert_allclose(view.overlap[:3, :3], np.where(np.eye(3), 1, 0.9))
    np.testing.assert_allclose(view.similarity, view.similarity.T)
    assert view.distance_m[0, 3] == pytest.approx(20)
    with pytest.raises(ValueError, match="read-only"):
        view.overlap[0, 0] = 0


def test_labels_stay_when_a_robot_comes_back() -> None:
    scene = two_groups()
    before = groups(scene)
    for _ in range(9):
        for robot in ("a1", "a2", "b1", "b2", "b3"):
            scene.send(robot, pose(0.0 if robot[0] == "a" else 20.0))
        scene.work(scene.wait(4.5), share)
    assert scene.snapshot.groups.ungrouped == (("a3", "gone"),)
    scene.send("a3", pose(0.2))
    scene.settle(share)
    assert groups(scene) == before


def alone(**options: object) -> Scene:
    """a3, whose group is about to be another."""
    scene = Scene.of(regroup_after_s=0.0, grouping=GroupingOptions(smoothing=1.0, **options))
    for robot, x_m in (("a1", 0.0), ("a2", 0.1), ("a3", 0.2), ("b1", 20.0), ("b2", 20.1)):
        scene.send(robot, pose(x_m))
    scene.settle(share)
    # What the first views of few proposed is settled by then.
    scene.wait(4.5)
    return scene


def drifts(scene: Scene, sees: float) -> list[str]:
    """Kinds of what happened when a3 sees so much of what the other two see."""
    scene.send("a3", pose(0.2))
    found = {("a1", "a3"): sees, ("a2", "a3"): sees}

    def share_of(job):
        q = found.get((job.first.robot, job.second.robot), 0.9 if job.first.robot[0] == job.second.robot[0] else 0.0)
        return measured(q, q)

    return [kind for kind, _ in happenings(scene.settle(share_of))]


STEADY = HysteresisOptions(persistence_s=4.0, clear=1e6)


def test_a_change_without_a_clear_gain_waits_until_it_has_lasted() -> None:
    scene = alone(hysteresis=STEADY, alpha=1.0)
    assert ("a1", "a2", "a3") in groups(scene).values()
    assert "split" not in drifts(scene, 0.0)
    assert scene.snapshot.groups.waiting == ("a1", "a2", "a3")
    scene.wait(3.9)
    assert ("a1", "a2", "a3") in groups(scene).values()
    # Nothing new is heard: time alone brings it about.
    assert "split" in [kind for kind, _ in happenings(scene.wait(0.2))]
    assert ("a3",) in groups(scene).values()
    assert scene.snapshot.groups.waiting == ()


def test_a_change_that_is_taken_back_in_time_is_never_shown() -> None:
    scene = alone(hysteresis=STEADY, alpha=1.0)
    revision = scene.snapshot.groups.revision
    for _ in range(4):
        drifts(scene, 0.0)
        scene.wait(2.0)
        drifts(scene, 0.9)
        scene.wait(2.0)
    assert scene.snapshot.groups.revision == revision


def test_without_hysteresis_every_change_is_shown_at_once() -> None:
    scene = alone(hysteresis=HysteresisOptions(0.0, 0.0, 0.0), alpha=1.0)
    assert "split" in drifts(scene, 0.0)
    assert "merge" in drifts(scene, 0.9)


def test_new_settings_are_not_held_back() -> None:
    scene = alone(hysteresis=STEADY)
    scene.station.set_grouping(GroupingOptions(groups=4, hysteresis=STEADY))
    scene.tick()
    assert len(groups(scene)) == 4


def test_who_comes_or_goes_is_not_held_back() -> None:
    scene = alone(hysteresis=STEADY)
    scene.send("a4", pose(0.15))
    kinds = [kind for kind, _ in happenings(scene.settle(share))]
    assert "join" in kinds
    assert ("a1", "a2", "a3", "a4") in groups(scene).values()


def test_smoothed_overlaps_follow_slowly() -> None:
    scene = Scene.of(regroup_after_s=0.0, grouping=GroupingOptions(alpha=1.0, smoothing=0.5))
    for robot in ("a1", "a2"):
        scene.send(robot, pose(0.0))
    scene.settle(lambda job: measured(0.8, 0.8))
    before = scene.snapshot.similarity.similarity[0, 1]
    scene.send("a1", pose(0.0))
    scene.settle(lambda job: measured(0.4, 0.4))
    view = scene.snapshot.similarity
    assert view.overlap[0, 1] == pytest.approx(0.4)
    assert 0.4 < view.similarity[0, 1] < before


def test_settings_that_nobody_can_keep_are_noted_and_told_once() -> None:
    scene = alone()
    scene.station.set_grouping(GroupingOptions(groups=3, min_group_size=2))
    told = happenings(scene.tick())
    assert ("warning", "groups: 5 robots cannot form 3 groups of at least 2") in told
    assert len(groups(scene)) == 3
    assert scene.snapshot.groups.note == "5 robots cannot form 3 groups of at least 2"
    assert not [kind for kind, _ in happenings(scene.wait(1.0)) if kind == "warning"]
    scene.send("c1", pose(20.2))
    scene.settle(share)
    assert scene.snapshot.groups.note is None
    assert sorted(map(len, groups(scene).values())) == [2, 2, 2]


def test_the_printed_criterion_is_not_meant_for_large_swarms() -> None:
    scene = Scene.of(grouping=GroupingOptions(criterion="paper"))
    for number in range(31):
        scene.send_pose(f"r{number:02}", pose(number))
    scene.tick()
    assert scene.snapshot.groups.note == "criterion paper is not meant for more than 30 robots, and these are 31"


@pytest.mark.parametrize("grouping", ["components", "distance"])
def test_groups_can_be_made_from_links_or_from_closeness_alone(grouping) -> None:
    scene = two_groups()
    scene.station.set_grouping(GroupingOptions(grouping=grouping))
    scene.tick()
    assert sorted(groups(scene).values()) == [("a1", "a2", "a3"), ("b1", "b2", "b3")]
    # One who stands with the one group and sees what the other sees is linked to neither strongly enough.
    scene.send("a3", pose(20.05))
    scene.settle(share)
    scene.wait(10.0)
    expected = ("a3",) if grouping == "components" else ("a3", "b1", "b2", "b3")
    assert expected in groups(scene).values()


def test_no_settings_and_no_robots_are_no_reason_to_fail() -> None:
    scene = Scene()
    scene.station.set_grouping(GroupingOptions(groups=5, min_group_size=3))
    assert scene.tick() == []
    assert scene.snapshot.groups.groups == ()


@pytest.mark.parametrize("criterion", ["adaptive", "silhouette", "gain", "fiedler", "paper", "eigengap", "modularity"])
@pytest.mark.parametrize("x_m", [(0.0,), (1.0, 1.0), (2.0, 2.0, 2.0, 2.0)])
def test_one_robot_and_robots_in_one_place_have_finite_scores(criterion, x_m: tuple[float, ...]) -> None:
    scene = Scene.of(grouping=GroupingOptions(criterion=criterion))
    for number, x in enumerate(x_m):
        scene.send_pose(f"r{number}", pose(x))
    scene.tick()
    view = scene.snapshot
    assert np.isfinite(view.similarity.similarity).all()
    assert np.isfinite([score for _, score in view.groups.scores]).all()
    assert sorted(robot for group in view.groups.groups for robot in group.robots) == sorted(view.robots)


def test_a_keyframe_counts_once_however_often_it_is_read() -> None:
    scene = Scene.of(regroup_after_s=0.0, grouping=GroupingOptions(alpha=1.0, smoothing=0.3))
    for robot in ("a1", "a2", "a3", "a4"):
        scene.send(robot, pose(0.0))
    scene.settle(lambda job: measured(0.8, 0.8))
    scene.send("a1", pose(0.0))
    # Each survey of the new keyframe has the overlaps with all others read anew.
    scene.settle(lambda job: measured(0.2, 0.2))
    view = scene.snapshot.similarity
    assert view.overlap[0, 1:].tolist() == [0.2, 0.2, 0.2]
    np.testing.assert_allclose(view.similarity[0, 1:], 0.8 + 0.3 * (0.2 - 0.8))


def test_without_smoothing_any_more_the_newest_overlap_stands_at_once() -> None:
    scene = Scene.of(regroup_after_s=0.0, grouping=GroupingOptions(alpha=1.0, smoothing=0.3))
    for q in (0.8, 0.2):
        for robot in ("a1", "a2"):
            scene.send(robot, pose(0.0))
        scene.settle(lambda job, q=q: measured(q, q))
    assert scene.snapshot.similarity.similarity[0, 1] > 0.3
    scene.station.set_grouping(GroupingOptions(alpha=1.0, smoothing=1.0))
    scene.tick()
    assert scene.snapshot.similarity.similarity[0, 1] == pytest.approx(0.2)


@pytest.mark.parametrize(("gain", "stays"), [(0.0, False), (0.6, True)])
def test_groups_on_show_are_held_on_to_by_the_gain(gain: float, stays: bool) -> None:
    scene = alone(hysteresis=HysteresisOptions(gain, 0.0), alpha=1.0)
    # Less than an outsider offers, but not by much.
    kinds = drifts(scene, 0.02)
    assert ("split" in kinds) is not stays


def test_how_steady_groups_are_does_not_show_what_is_pending() -> None:
    scene = alone(hysteresis=STEADY, alpha=1.0)
    assert "split" not in drifts(scene, 0.0)
    slower = HysteresisOptions(persistence_s=60.0, clear=1e6)
    scene.station.set_grouping(GroupingOptions(smoothing=1.0, hysteresis=slower, alpha=1.0))
    assert "split" not in [kind for kind, _ in happenings(scene.wait(10.0))]
    scene.station.set_grouping(GroupingOptions(smoothing=1.0, hysteresis=slower, alpha=0.99))
    assert "split" in [kind for kind, _ in happenings(scene.tick())]


def test_a_clock_set_back_does_not_make_a_change_wait_for_it() -> None:
    scene = alone(hysteresis=STEADY, alpha=1.0)
    assert "split" not in drifts(scene, 0.0)
    told = [*scene.wait(-3600.0), *scene.wait(4.1)]
    assert "split" in [kind for kind, _ in happenings(told)]


def test_what_cannot_be_shown_alone_waits_and_is_not_looked_at_again_and_again() -> None:
    """With two groups asked for, a3 alone would be the third."""
    scene = alone(hysteresis=STEADY, alpha=1.0, groups=2)
    before = groups(scene)
    drifts(scene, 0.0)
    assert all(len(groups(scene)) == 2 for _ in range(20) if scene.wait(0.5) is not None)
    assert groups(scene) == before
    revision = scene.snapshot.similarity.revision
    for _ in range(50):
        scene.wait(0.1)
    assert scene.snapshot.similarity.revision <= revision + 1


def test_a_warning_is_told_again_only_for_other_settings() -> None:
    scene = Scene.of(grouping=GroupingOptions(groups=4))
    warnings = 0
    for number in range(3):
        scene.send_pose(f"r{number}", pose(number))
        warnings += sum(kind == "warning" for kind, _ in happenings(scene.tick()))
    assert warnings == 1
    scene.station.set_grouping(GroupingOptions(groups=5))
    assert ("warning", "groups: 3 robots cannot form 5 groups") in happenings(scene.tick())


def test_large_swarms_are_evaluated_less_often() -> None:
    scene = Scene.of(regroup_after_s=0.01)
    for number in range(200):
        scene.send_pose(f"r{number:03}", pose(number))
    scene.tick()
    revision = scene.snapshot.similarity.revision
    for _ in range(9):
        scene.send_pose("r000", pose(0.0))
        scene.wait(0.01)
    assert scene.snapshot.similarity.revision == revision + 2


def test_before_anything_is_seen_clusters_of_positions_are_groups() -> None:
    scene = Scene.of(grouping=GroupingOptions(hysteresis=HysteresisOptions(0.0, 0.0, 0.0)))
    for cluster in range(4):
        for number in range(5):
            scene.send_pose(f"c{cluster}{number}", pose(20.0 * cluster + 0.2 * number))
    scene.tick()
    assert sorted(groups(scene).values()) == [tuple(f"c{k}{n}" for n in range(5)) for k in range(4)]
