from datetime import UTC, datetime

import cv2
import numpy as np
import pytest
from covista_schemas import features as vision
from covista_schemas.reports import Group, GroupsReport, LiveSettings, PairsReport, RobotsReport
from covista_service.api import examples
from covista_service.drawing import CommonField, canvas, overlay, swarm_map
from covista_service.perception.camera import Camera, Features, Pose
from covista_service.station.events import Keyframe, KeyframeId
from numpy.typing import NDArray

from tests.service.wall import picture, seen_from

MATRIX = np.array([[300.0, 0, 159.5], [0, 300.0, 119.5], [0, 0, 1]])
PLAIN = Camera(MATRIX, 320, 240)
LEFT_HALF = np.array([[-0.5, -0.5], [159.5, -0.5], [159.5, 239.5], [-0.5, 239.5]])


def keyframe(
    camera: Camera = PLAIN, image: bytes | None = None, features: Features | None = None, thumbnail: bytes | None = None
) -> Keyframe:
    return Keyframe(KeyframeId("r1", "b0", 0), 0, 0, camera, Pose(np.eye(3), np.zeros(3)), image, features, thumbnail)


def drawn(data: bytes) -> NDArray[np.uint8]:
    found = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert found is not None
    return np.asarray(found, np.uint8)


IMAGE = vision.encode_jpeg(np.full((240, 320, 3), 200, np.uint8))


def test_what_the_other_does_not_see_is_dimmed() -> None:
    found = drawn(overlay(keyframe(image=IMAGE), CommonField((LEFT_HALF,)), "half"))
    height, width = found.shape[:2]
    assert width == 640
    assert height > 480
    seen, unseen = found[50:430, 20:300].mean(), found[50:430, 340:620].mean()
    assert unseen == pytest.approx(0.35 * 200, abs=3)
    assert seen > 150


def test_nothing_in_common_is_dimmed_all_over() -> None:
    found = drawn(overlay(keyframe(image=IMAGE), CommonField(), "nothing"))
    assert found[10:470, 10:630].mean() == pytest.approx(0.35 * 200, abs=3)


def test_seams_to_holes_are_not_drawn() -> None:
    """A region's line runs along a seam to its hole and back: no border of what is seen."""
    ring = np.array([[-0.5, -0.5], [319.5, -0.5], [319.5, 239.5], [-0.5, 239.5], [-0.5, 99.5]])
    hole = np.array([[99.5, 99.5], [99.5, 139.5], [139.5, 139.5], [139.5, 99.5], [99.5, 99.5], [-0.5, 99.5]])
    found = drawn(overlay(keyframe(image=IMAGE), CommonField((np.vstack((ring, hole)),)), "hole"))
    along_the_seam = found[195:206, 20:180]
    assert along_the_seam.max() < 240


def test_planes_have_colours_of_their_own() -> None:
    right_half = LEFT_HALF + np.array([160, 0])
    found = drawn(overlay(keyframe(image=IMAGE), CommonField(polygons_px=(LEFT_HALF, right_half)), "two"))
    left, right = found[200:300, 100:200].mean(axis=(0, 1)), found[200:300, 420:520].mean(axis=(0, 1))
    assert np.abs(left - right).max() > 20


def test_points_lie_at_pixel_centres() -> None:
    point = np.array([[40.0, 50.0]])
    found = drawn(overlay(keyframe(image=IMAGE), CommonField((), (LEFT_HALF,), point, (0,)), "point"))
    yellow = (np.abs(found[:480].astype(int) - canvas.YELLOW) < 40).all(axis=2)
    rows, columns = np.nonzero(yellow)
    assert (columns.mean(), rows.mean()) == pytest.approx((2 * 40.5 - 0.5, 2 * 50.5 - 0.5), abs=0.5)


def test_a_pair_whose_field_is_not_known_is_the_picture_alone() -> None:
    found = drawn(overlay(keyframe(image=IMAGE), None, "unknown"))
    assert found[:480].mean() == pytest.approx(200, abs=2)


def test_features_alone_are_drawn_on_grey() -> None:
    seen = seen_from(0)
    found = drawn(overlay(keyframe(features=Features("rootsift", seen.keypoints_px, seen.descriptors)), None, "grey"))
    assert found.shape[1] == 640
    assert len(np.unique(found[:480])) > 1


def test_a_thumbnail_is_better_than_grey_and_a_broken_one_is_not() -> None:
    seen = seen_from(0)
    features = Features("rootsift", seen.keypoints_px, seen.descriptors)
    with_thumbnail = drawn(overlay(keyframe(features=features, thumbnail=vision.thumbnail(picture())), None, ""))
    broken = drawn(overlay(keyframe(features=features, thumbnail=b"broken"), None, ""))
    assert with_thumbnail[:480].std() > broken[:480].std()


@pytest.mark.parametrize(
    ("model", "coefficients"),
    [("plumb_bob", (-0.4, 0.1, 0.0, 0.0)), ("equidistant", (0.1, 0.0, 0.0, 0.0))],
)
def test_the_picture_is_straightened_as_the_regions_are(model: str, coefficients: tuple[float, ...]) -> None:
    """A bright spot of the distorted picture appears where `undistort` says."""
    from covista_service.perception.camera import undistort

    camera = Camera(MATRIX, 320, 240, model, coefficients)
    image = np.zeros((240, 320, 3), np.uint8)
    cv2.circle(image, (250, 60), 3, (255, 255, 255), -1)
    found = drawn(overlay(keyframe(camera, vision.encode_jpeg(image, 95)), None, ""))[:480, :, 0]
    rows, columns = np.nonzero(found > 128)
    x, y = undistort(camera, np.array([[250.0, 60.0]]))[0]
    assert (columns.mean(), rows.mean()) == pytest.approx((2 * x + 0.5, 2 * y + 0.5), abs=1.5)


def test_no_points_and_no_polygons_are_no_trouble() -> None:
    drawn(overlay(keyframe(image=IMAGE), CommonField(), ""))
    drawn(overlay(keyframe(image=IMAGE), CommonField((np.zeros((0, 2)),)), ""))


def groups_of(*groups: tuple[str, ...]) -> GroupsReport:
    return GroupsReport(
        revision=1,
        time=datetime(2026, 1, 1, tzinfo=UTC),
        groups=[Group(label=f"g{i}", robots=list(robots)) for i, robots in enumerate(groups)],
        ungrouped=[],
        criterion="fiedler",
        scores=[],
        settings=LiveSettings(),
    )


def test_the_map_shows_robots_groups_and_walls() -> None:
    other = examples.ROBOT.model_copy(
        update={"id": "r2", "pose": examples.ROBOT.pose.model_copy(update={"position_m": (4.0, 1.0, 0.6)})}
    )
    nowhere = examples.ROBOT.model_copy(update={"id": "r3", "pose": None})
    robots = RobotsReport(robots=[examples.ROBOT, other, nowhere])
    wall = np.array([[0.0, -3, 0], [5, -3, 0], [5, -3.2, 0]])
    found = drawn(swarm_map(robots, examples.PAIRS, groups_of(("r1",), ("r2",)), walls=[wall]))
    assert found.shape == (700, 900, 3)
    for index in (0, 1):
        assert (np.abs(found.astype(int) - canvas.palette(index)) < 8).all(axis=2).sum() > 200


def test_a_map_of_nobody_is_a_map() -> None:
    drawn(swarm_map(RobotsReport(robots=[]), PairsReport(pairs=[]), groups_of()))


@pytest.mark.parametrize("size", [(65_535, 65_535), (1, 65_535), (4000, 3000)])
def test_a_picture_stays_of_a_size_whatever_the_camera_claims(size: tuple[int, int]) -> None:
    corner = Features("orb", np.zeros((1, 2), np.float32), np.zeros((1, 32), np.uint8))
    for bare in (keyframe(Camera(MATRIX, *size), features=corner), keyframe(Camera(MATRIX, *size), thumbnail=IMAGE)):
        found = drawn(overlay(bare, CommonField((LEFT_HALF,)), "large"))
        assert max(found.shape) <= 2048 + 64
