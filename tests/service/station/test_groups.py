"""Who belongs together, as the station tells it."""

import numpy as np
import pytest
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
    assert view.group_of("b2") in view.groups.groups
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
