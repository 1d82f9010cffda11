import numpy as np
import pytest
from covista_schemas.reports import FoundBy, GroupBounds, Hysteresis, LiveSettings
from covista_service import answers
from covista_service.answers.robots import quaternion_of
from covista_service.grouping.hysteresis import HysteresisOptions
from covista_service.perception.camera import Pose, rotation_of
from covista_service.perception.comparison import Comparison
from covista_service.perception.relative_pose import RelativePose
from covista_service.perception.sightings import Sightings
from covista_service.station.events import MessageDropped, SurveyPair
from covista_service.station.options import GroupingOptions
from covista_service.station.snapshot import Snapshot
from hypothesis import given
from hypothesis import strategies as st

from tests.service.perception.scenes import project
from tests.service.station.scenes import AHEAD, CAMERA, START_NS, Found, Scene

TURNED = rotation_of((0.5, 0.5, -0.5, 0.5))
FIRST = Pose(TURNED, np.array([1.0, 2.0, 3.0]))
# Half a metre to the right of the first camera.
SECOND = Pose(TURNED, FIRST.centre_m + TURNED @ np.array([0.5, 0, 0]))
# Points of the plane z = 4 of the first camera.
ON_WALL = np.column_stack((np.random.default_rng(0).uniform(-1.2, 1.2, (40, 2)), np.full(40, 4.0)))


def both_see_the_wall(job: SurveyPair) -> Found:
    """What comparing the images of two keyframes before a wall comes to."""
    pose = RelativePose(np.eye(3), np.array([-0.5, 0, 0]), "reported", np.ones(len(ON_WALL), bool), True)
    one, other = (project(CAMERA, Pose(np.eye(3), np.array([x, 0, 0])), ON_WALL) for x in (0.0, 0.5))
    matches = np.column_stack(2 * [np.arange(len(ON_WALL))])
    return Found(Comparison(True, matches, Sightings(CAMERA, CAMERA, one, other), pose), (0.25, 0.75))


@pytest.fixture(scope="module")
def scene() -> Scene:
    scene = Scene()
    scene.send("r1", FIRST)
    scene.send("r2", SECOND)
    scene.settle(both_see_the_wall)
    scene.receive(MessageDropped("r3", "pose", "malformed", "payload: garbage", START_NS, counted=False, count=2))
    scene.settle(both_see_the_wall)
    scene.wait(2)
    return scene


@pytest.fixture(scope="module")
def snapshot(scene: Scene) -> Snapshot:
    return scene.snapshot


def test_a_robot_s_report_says_all_that_is_known(snapshot: Snapshot) -> None:
    robot = answers.robot_report(snapshot, "r1")
    assert robot.pose is not None
    assert robot.pose.position_m == (1, 2, 3)
    np.testing.assert_allclose(rotation_of(robot.pose.orientation_xyzw), TURNED, atol=1e-12)
    assert robot.camera is not None
    assert (robot.camera.fx, robot.camera.cx, robot.camera.width) == (300, 159.5, 320)
    assert robot.keyframe == robot.heard
    assert robot.keyframe is not None
    assert (robot.keyframe.boot, robot.keyframe.sequence) == ("b0", 0)
    assert (robot.keyframes.received, robot.keyframes.used, robot.last_problem) == (1, 1, None)


def test_a_robot_of_which_only_rubbish_came_is_there_with_its_accounts(snapshot: Snapshot) -> None:
    robot = answers.robot_report(snapshot, "r3")
    assert (robot.pose, robot.camera, robot.keyframe, robot.heard) == (None, None, None, None)
    assert robot.poses.dropped == {"malformed": 2}
    assert robot.poses.received == 2
    assert robot.last_problem == "payload: garbage"


def test_robots_are_sorted(snapshot: Snapshot) -> None:
    assert [robot.id for robot in answers.robots_report(snapshot).robots] == ["r1", "r2", "r3"]


def test_a_pair_is_told_in_the_order_asked(snapshot: Snapshot) -> None:
    forward, back = answers.pair_report(snapshot, "r1", "r2"), answers.pair_report(snapshot, "r2", "r1")
    assert (forward.a, forward.b, forward.overlap_a, forward.overlap_b) == ("r1", "r2", 0.25, 0.75)
    assert (back.a, back.b, back.overlap_a, back.overlap_b) == ("r2", "r1", 0.75, 0.25)
    assert (forward.regions_a, forward.regions_b) == (back.regions_b, back.regions_a)
    assert forward.planes[0].polygon_a == back.planes[0].polygon_b
    assert forward.planes[0].polygon_b == back.planes[0].polygon_a
    assert (forward.found_by, forward.outcome, forward.pose_source) == (FoundBy.IMAGE, "measured", "reported")
    assert forward.age_s == 2


def test_regions_are_what_the_surfaces_show(snapshot: Snapshot) -> None:
    """Half a metre aside at four metres: all but the leftmost 37.5 px of the first image."""
    (region,) = answers.pair_report(snapshot, "r1", "r2").regions_a
    left, right = min(x for x, _ in region), max(x for x, _ in region)
    assert left == pytest.approx(37.0, abs=320 / 48)
    assert right == 319.5


def test_planes_are_in_the_world(snapshot: Snapshot) -> None:
    """Points of the plane z = 4 of the first camera lie on it."""
    (plane,) = answers.pair_report(snapshot, "r1", "r2").planes
    for seen in ([0, 0, 4], [1, -2, 4], [-3, 0.5, 4]):
        world = TURNED @ np.array(seen, float) + [1, 2, 3]
        assert np.dot(plane.normal, world) + plane.offset_m == pytest.approx(0, abs=1e-6)
    assert np.linalg.norm(plane.normal) == pytest.approx(1)


def test_a_pair_of_known_robots_may_be_unknown(snapshot: Snapshot) -> None:
    pair = answers.pair_report(snapshot, "r1", "r3")
    assert (pair.found_by, pair.overlap_a, pair.overlap_b, pair.keyframes) == (FoundBy.UNKNOWN, None, None, None)
    assert (pair.planes, pair.regions_a, pair.pose_source, pair.age_s) == ([], [], None, None)


@pytest.mark.parametrize(("a", "b"), [("r1", "r9"), ("r9", "r1"), ("r1", "r1")])
def test_a_pair_that_cannot_be_is_not_known(snapshot: Snapshot, a: str, b: str) -> None:
    with pytest.raises(answers.NotKnownError):
        answers.pair_report(snapshot, a, b)


def test_pairs_are_every_unordered_pair_once_and_can_be_narrowed(snapshot: Snapshot) -> None:
    def names(**asked: object) -> list[tuple[str, str]]:
        return [(pair.a, pair.b) for pair in answers.pairs_report(snapshot, **asked).pairs]

    assert names() == [("r1", "r2"), ("r1", "r3"), ("r2", "r3")]
    assert names(robot="r3") == [("r1", "r3"), ("r2", "r3")]
    assert names(min_overlap=0.7) == [("r1", "r2")]
    assert names(min_overlap=0.8) == []
    assert names(min_overlap=0.0) == names()
    with pytest.raises(answers.NotKnownError):
        names(robot="r9")


def test_unknown_overlaps_are_null_and_the_diagonal_is_one(scene: Scene) -> None:
    lonely = Scene()
    lonely.send("r1")
    lonely.send("r2", Pose(AHEAD, np.array([900.0, 0.0, 0.0])))
    lonely.tick()
    report = answers.similarity_report(lonely.snapshot)
    assert report.robots == ["r1", "r2"]
    assert report.overlap == [[1, None], [None, 1]]
    known = answers.similarity_report(scene.snapshot)
    assert known.overlap == [[1, 0.25], [0.75, 1]]
    assert type(known).model_validate_json(known.model_dump_json()) == known


def test_groups_and_own_groups_agree(snapshot: Snapshot) -> None:
    groups = answers.groups_report(snapshot)
    grouped = {robot: group.label for group in groups.groups for robot in group.robots}
    for robot in ("r1", "r2", "r3"):
        own = answers.own_group_report(snapshot, robot)
        assert own.label == grouped.get(robot)
        assert own.revision == groups.revision
        assert answers.robot_report(snapshot, robot).group == own.label
    assert [(each.robot, each.reason) for each in groups.ungrouped] == [("r3", "no_pose")]
    assert answers.group_report(snapshot, grouped["r1"]).label == grouped["r1"]
    with pytest.raises(answers.NotKnownError):
        answers.group_report(snapshot, "g99")


def test_settings_are_told_as_they_are_set() -> None:
    options = GroupingOptions(0.25, (2, 3), 2, 1.5, "paper", "distance", HysteresisOptions(0.1, 2.0), 0.5)
    settings = answers.groups_report(Scene.of(grouping=options).snapshot).settings
    assert settings == LiveSettings(
        alpha=0.25,
        groups=GroupBounds(min=2, max=3),
        min_group_size=2,
        sigma=1.5,
        criterion="paper",
        grouping="distance",
        hysteresis=Hysteresis(gain=0.1, persistence_s=2.0, smoothing=0.5),
    )


def test_defaults_inside_are_those_outside() -> None:
    assert answers.groups_report(Scene.of(grouping=GroupingOptions()).snapshot).settings == LiveSettings()


def test_what_cannot_be_kept_is_noted() -> None:
    scene = Scene.of(grouping=GroupingOptions(groups=3))
    scene.send("r1")
    scene.tick()
    report = answers.groups_report(scene.snapshot)
    assert report.note == "1 robot cannot form 3 groups"
    assert [group.robots for group in report.groups] == [["r1"]]


def test_components_are_a_criterion_of_their_own() -> None:
    scene = Scene.of(grouping=GroupingOptions(grouping="components"))
    scene.send("r1")
    scene.tick()
    report = answers.groups_report(scene.snapshot)
    assert (report.criterion, [score.groups for score in report.scores]) == ("components", [1])


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternions_and_rotations_are_each_other_s_inverse(q: tuple[float, float, float, float]) -> None:
    rotation = rotation_of(q)
    found = quaternion_of(rotation)
    assert found[3] >= 0
    np.testing.assert_allclose(np.linalg.norm(found), 1, atol=1e-12)
    np.testing.assert_allclose(rotation_of(found), rotation, atol=1e-9)
