"""What comes of input that no method can do well with: an outcome with a name, or an answer that is stated here.

Whatever comes in, no exception, no warning and no NaN comes out.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
from covista_schemas import features as extraction
from covista_service.perception.camera import Camera, Features, Floats, Pose, View
from covista_service.perception.frustum import overlap
from covista_service.perception.scene import SceneOptions, reconstruct
from covista_service.perception.survey import Outcome, Survey, SurveyOptions, survey

from tests.service.perception.scenes import CAMERA, turn
from tests.service.perception.swarms import moved, points_on_wall, views

HERE = Pose(np.eye(3), np.zeros(3))
ASIDE = Pose(np.eye(3), np.array([1.0, 0, 0]))
BACK = Pose(turn(0, np.pi, 0), np.array([0, 0, -1.0]))
WALL = points_on_wall(1500, slope=0.0)


@pytest.fixture(autouse=True)
def no_warnings() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def both(first: View, second: View) -> tuple[Survey, tuple[float, float] | None, int]:
    """The survey of planes; what surfaces say of the pair, and the matched points behind it."""
    found = survey(first, second, SurveyOptions())
    assert all(np.isfinite(plane.normal).all() for plane in found.planes)
    scene = reconstruct([first, second], [(0, 1)], SceneOptions())
    shares = scene.overlap(0, 1)
    assert shares is None or (np.isfinite(shares).all() and min(shares) >= 0 and max(shares) <= 1)
    assert all(one is None or np.isfinite(one.inverse_depth).all() for one in scene.surfaces)
    return found, shares, scene.matched[0, 1]


def first_of(view: View, count: int) -> View:
    kept = slice(0, count)
    return replace(
        view, features=Features("rootsift", view.features.keypoints_px[kept], view.features.descriptors[kept])
    )


def shuffled(view: View, seed: int = 0) -> View:
    """The same keypoints, each with another's descriptor."""
    order = np.random.default_rng(seed).permutation(len(view.features.descriptors))
    return replace(view, features=replace(view.features, descriptors=view.features.descriptors[order]))


@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_fewer_than_eight_matches_verify_nothing(count: int) -> None:
    one, other = views(WALL, [HERE, HERE])
    found, shares, matched = both(first_of(one, count), first_of(other, count))
    assert (found.outcome, found.overlap_first, shares, matched) == (Outcome.FEW_MATCHES, None, None, 0)


def test_matches_that_are_all_wrong_are_unverified() -> None:
    one, other = views(WALL, [HERE, ASIDE])
    found, shares, matched = both(one, shuffled(other))
    assert (found.outcome, found.overlap_first) == (Outcome.UNVERIFIED, None)
    assert (shares, matched) == (None, 0)


def test_the_same_image_from_the_same_place_is_seen_whole_if_its_depth_is_known() -> None:
    """From one place nothing tells depths, and without any there is no answer; another robot's parallax gives both."""
    one, other, third = views(WALL, [HERE, HERE, ASIDE])
    found, shares, matched = both(one, other)
    assert (found.outcome, shares, matched) == (Outcome.NO_PARALLAX, None, 0)
    scene = reconstruct([one, other, third], [(0, 1), (0, 2), (1, 2)], SceneOptions())
    assert scene.overlap(0, 1) == (1.0, 1.0)


def test_the_same_image_reported_from_two_places_is_not_believed() -> None:
    """Images without parallax contradict the baseline that was reported; nothing is told of depths."""
    one, _ = views(WALL, [HERE, ASIDE])
    found, shares, _ = both(one, moved(one, ASIDE))
    assert found.outcome in (Outcome.NO_PARALLAX, Outcome.UNVERIFIED)
    assert shares is None or min(shares) > 0.9


@pytest.mark.parametrize("grey", [0, 255])
@pytest.mark.parametrize("kind", ["rootsift", "orb"])
def test_black_and_saturated_images_have_no_features(grey: int, kind: str) -> None:
    found = extraction.extract(np.full((480, 640), grey, np.uint8), kind)
    blank = View(CAMERA, HERE, Features(kind, found.keypoints_px, found.descriptors))
    result, shares, _ = both(blank, replace(blank, pose=ASIDE))
    assert (result.outcome, shares) == (Outcome.FEW_MATCHES, None)


def picture(image: np.ndarray, pose: Pose) -> View:
    found = extraction.extract(image)
    return View(CAMERA, pose, Features("rootsift", found.keypoints_px, found.descriptors))


def noise(seed: int) -> np.ndarray:
    """Blobs of all sizes."""
    random = np.random.default_rng(seed)
    layers = [cv2.resize(random.uniform(0, 1, (480 // k, 640 // k)), (640, 480)) for k in (4, 8, 16, 32)]
    total = np.sum(layers, axis=0)
    return np.rint(255 * (total - total.min()) / np.ptp(total)).astype(np.uint8)


def test_a_repeated_texture_is_not_taken_for_one_place() -> None:
    """Every tile looks like its neighbours: no match stands out, or those that do contradict each other."""
    tile = noise(1)[:80, :80]
    tiled = np.tile(tile, (6, 8))
    result, _, _ = both(picture(tiled, HERE), picture(np.roll(tiled, 37, axis=1), ASIDE))
    assert result.outcome is not Outcome.MEASURED


def test_a_mirrored_image_has_nothing_in_common() -> None:
    """Round blobs match their own mirror images, along the same row; but no scene lies where that would put them."""
    image = noise(2)
    result, shares, matched = both(picture(image, HERE), picture(np.ascontiguousarray(image[:, ::-1]), ASIDE))
    assert not result.overlap_first
    assert (shares, matched) == (None, 0)


def test_cameras_back_to_back_share_nothing() -> None:
    """Both see walls of their own, known from two more cameras: the pair is predicted to have nothing in common."""
    behind = points_on_wall(1500, slope=0.0, seed=7) * [1, 1, -1]
    front = views(WALL, [HERE, ASIDE])
    rear = views(behind, [BACK, Pose(BACK.world_from_camera, BACK.centre_m + np.array([1.0, 0, 0]))])
    rear = [replace(view, features=other_descriptors(view.features)) for view in rear]
    scene = reconstruct([*front, *rear], [(i, j) for i in range(4) for j in range(i + 1, 4)], SceneOptions())
    assert scene.overlap(0, 2) == (0.0, 0.0)
    assert scene.matched[0, 2] == 0


def other_descriptors(features: Features) -> Features:
    """Descriptors that none of another scene looks like."""
    return replace(features, descriptors=np.ascontiguousarray(np.roll(255 - features.descriptors, 31, axis=1)))


@pytest.mark.parametrize(("width", "height"), [(1280, 40), (40, 1280)])
def test_images_much_wider_than_high_are_measured_like_others(width: int, height: int) -> None:
    camera = Camera(np.array([[500.0, 0, width / 2], [0, 500.0, height / 2], [0, 0, 1]]), width, height)
    dense = np.random.default_rng(4).uniform(-8, 8, (30_000, 2))
    points = np.column_stack((dense, np.full(len(dense), 6.0)))
    along = Pose(np.eye(3), np.array([1.0, 0, 0] if width > height else [0, 1.0, 0]))
    one, other = views(points, [HERE, along], camera=camera)
    _, shares, _ = both(one, other)
    assert shares == pytest.approx(overlap(camera, HERE, 6.0, camera, along, 6.0), abs=0.05)


def test_a_camera_twenty_times_nearer_sees_a_part_of_what_the_other_sees() -> None:
    """Points near the middle alone are common; the share of the far image is a four-hundredth."""
    near = Pose(np.eye(3), np.array([0.02, 0.01, 5.7]))
    random = np.random.default_rng(5)
    spots = np.column_stack((random.uniform(-0.25, 0.25, (400, 2)), np.full(400, 6.0)))
    one, other = views(np.vstack((WALL, spots)), [HERE, near])
    _, shares, matched = both(one, other)
    expected = overlap(CAMERA, HERE, 6.0, CAMERA, near, 0.3)
    assert matched > 50
    assert shares is not None
    assert shares[0] == pytest.approx(expected[0], abs=0.01)
    assert shares[1] > 0.95


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_intrinsics_that_are_off_by_a_tenth_cost_no_more_than_a_tenth(factor: float) -> None:
    wrong = Camera(np.diag([factor, factor, 1.0]) @ CAMERA.matrix, CAMERA.width, CAMERA.height)
    one, other = views(WALL, [HERE, ASIDE])
    right = both(one, other)[1]
    _, shares, matched = both(replace(one, camera=wrong), replace(other, camera=wrong))
    assert matched > 50
    assert right is not None
    assert shares == pytest.approx(right, abs=0.1)


def distorted(view: View, camera: Camera) -> View:
    """The same view through a lens that bends."""
    rays = np.column_stack((view.features.keypoints_px, np.ones(len(view.features.keypoints_px))))
    rays = rays @ camera.rays_from_pixels.T
    bend = cv2.projectPoints if camera.distortion == "plumb_bob" else None
    coefficients = np.array(camera.coefficients)
    if bend is not None:
        px = bend(rays, np.zeros(3), np.zeros(3), camera.matrix, coefficients)[0][:, 0]
    else:
        px = cv2.fisheye.distortPoints(rays[:, None, :2].copy(), camera.matrix, coefficients)[:, 0]
    return View(camera, view.pose, replace(view.features, keypoints_px=px.astype(np.float32)))


@pytest.mark.parametrize(
    ("model", "coefficients"),
    [("plumb_bob", (-0.2, 0.03, 0.001, -0.001, 0.0)), ("equidistant", (0.05, -0.01, 0.002, 0.0))],
)
@pytest.mark.parametrize("across_deg", [60, 90, 120])
def test_bent_lenses_measure_what_straight_ones_do(
    model: str, coefficients: tuple[float, ...], across_deg: int
) -> None:
    focal = 320 / np.tan(np.radians(across_deg / 2))
    straight = Camera(np.array([[focal, 0, 319.5], [0, focal, 239.5], [0, 0, 1]]), 640, 480)
    if model == "plumb_bob" and across_deg == 120:
        coefficients = (-0.03, 0.001, 0.0, 0.0, 0.0)  # a polynomial bends no further than this without folding
    bent = replace(straight, distortion=model, coefficients=coefficients)
    one, other = views(points_wide(), [HERE, ASIDE], camera=straight)
    expected = both(one, other)[1]
    _, shares, matched = both(distorted(one, bent), distorted(other, bent))
    assert matched > 50
    assert expected is not None
    assert shares == pytest.approx(expected, abs=0.02)


def points_wide() -> Floats:
    random = np.random.default_rng(6)
    return np.column_stack((random.uniform(-14, 14, 1800), random.uniform(-9, 9, 1800), np.full(1800, 6.0)))
