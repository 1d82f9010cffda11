import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from covista_service.perception.camera import Camera, Features, Pose, View, relative
from covista_service.perception.overlap import common_field
from covista_service.perception.survey import Outcome, Survey, SurveyOptions, survey

from tests.service.perception.scenes import CAMERA, ORIGIN, Scene, beside, corner, scene, turn, wall

OPTIONS = SurveyOptions()


def features(count: int, seed: int, kind: str = "rootsift") -> Features:
    """Features that match no others."""
    random = np.random.default_rng(seed)
    points = random.uniform([0, 0], [639, 479], (count, 2)).astype(np.float32)
    return Features(kind, points, random.integers(0, 90, (count, 128), dtype=np.uint8))


def view(found: Features, pose: Pose = ORIGIN) -> View:
    return View(CAMERA, pose, found)


def assert_sound(found: Survey) -> None:
    """No NaN anywhere; arrays fit each other; only what is measured has overlaps."""
    for name in (field.name for field in dataclasses.fields(found)):
        value = getattr(found, name)
        if isinstance(value, np.ndarray):
            assert np.isfinite(value).all(), name
    lengths = {len(found.points_first_px), len(found.points_second_px), len(found.depths_first)}
    assert lengths == {len(found.depths_second)} == {len(found.plane_of_point)}
    measured = found.outcome is Outcome.MEASURED
    answered = found.overlap_first is not None
    assert answered == (found.overlap_second is not None)
    assert answered or not measured
    assert not answered or found.outcome in (Outcome.MEASURED, Outcome.NO_PARALLAX)
    assert not measured or len(found.planes)
    for plane in found.planes:
        assert np.isfinite(plane.normal).all()
        assert np.isfinite(plane.region_first).all()
        assert np.isfinite(plane.region_second).all()


def overlaps(found: Survey, outcome: Outcome = Outcome.MEASURED) -> np.ndarray:
    assert found.outcome is outcome
    return np.array([found.overlap_first, found.overlap_second])


def truth(made: Scene) -> np.ndarray:
    field = common_field(CAMERA, CAMERA, *relative(ORIGIN, made.second.pose), made.planes)
    return np.array([field.overlap_first, field.overlap_second])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("planes", [wall(), corner()], ids=["wall", "corner"])
def test_the_overlap_comes_out_of_matches_alone(planes: np.ndarray, seed: int) -> None:
    made = scene(planes, beside(seed), 300, 0.4, 0.15, seed)
    found = survey(made.first, made.second, OPTIONS)
    assert_sound(found)
    np.testing.assert_allclose(overlaps(found), truth(made), atol=0.05)


@pytest.mark.parametrize(("noise_px", "seed"), [(0.0, 1), (0.0, 6), (0.5, 1), (0.5, 2), (1.0, 3)])
def test_the_length_of_the_baseline_does_not_matter(noise_px: float, seed: int) -> None:
    made = scene(corner(), beside(1), 300, noise_px, 0.1, seed)
    one = overlaps(survey(made.first, made.second, OPTIONS))
    for w in (0.1, 0.3, 3.0, 10.0):
        scaled = made.with_poses(ORIGIN, Pose(beside(1).world_from_camera, w * beside(1).centre_m))
        np.testing.assert_allclose(overlaps(survey(scaled.first, scaled.second, OPTIONS)), one, atol=1e-9)


def test_moving_the_world_frame_changes_nothing() -> None:
    made = scene(corner(), beside(2), 300, 0.4, 0.1)
    one = overlaps(survey(made.first, made.second, OPTIONS))
    world, away = turn(0.4, -1.0, 2.0), np.array([3.0, -2.0, 1.0])
    poses = [Pose(world @ pose.world_from_camera, world @ pose.centre_m + away) for pose in (ORIGIN, beside(2))]
    moved = made.with_poses(*poses)
    np.testing.assert_allclose(overlaps(survey(moved.first, moved.second, OPTIONS)), one, atol=1e-6)


@pytest.mark.parametrize(("noise_px", "within"), [(0.0, 0.01), (0.4, 0.03)])
def test_swapping_the_cameras_swaps_the_shares(noise_px: float, within: float) -> None:
    made = scene(corner(), beside(3), 300, noise_px)
    there = overlaps(survey(made.first, made.second, OPTIONS))
    back = overlaps(survey(made.second, made.first, OPTIONS))
    np.testing.assert_allclose(back[::-1], there, atol=within)


@pytest.mark.parametrize("noise_px", [0.0, 0.5])
def test_the_same_view_of_the_same_things_has_everything_in_common(noise_px: float) -> None:
    made = scene(corner(), ORIGIN, 200, noise_px)
    np.testing.assert_allclose(overlaps(survey(made.first, made.second, OPTIONS), Outcome.NO_PARALLAX), 1.0, atol=1e-9)


def test_a_wrong_reported_pose_is_put_right() -> None:
    made = scene(corner(), beside(4), 300, 0.4, 0.1)
    reported = Pose(
        beside(4).world_from_camera @ turn(0.04, -0.03, 0.02), beside(4).centre_m + np.array([0.05, 0.1, 0])
    )
    found = survey(made.first, dataclasses.replace(made.second, pose=reported), OPTIONS)
    assert found.pose_source == "images"
    np.testing.assert_allclose(overlaps(found), truth(made), atol=0.05)


def test_the_last_survey_helps_the_next() -> None:
    made = scene(corner(), beside(), 300, 0.4, 0.1)
    last = survey(made.first, made.second, OPTIONS)
    again = survey(made.first, made.second, OPTIONS, last)
    np.testing.assert_allclose(overlaps(again), truth(made), atol=0.05)


def test_lenses_that_distort_are_taken_into_account() -> None:
    bent = Camera(CAMERA.matrix, 640, 480, "plumb_bob", (-0.05, 0.01, 0.0, 0.0))
    made = scene(wall(), beside(), 200)
    found = survey(dataclasses.replace(made.first, camera=bent), dataclasses.replace(made.second, camera=bent), OPTIONS)
    assert_sound(found)


def test_the_same_seed_gives_the_same_survey_in_every_thread() -> None:
    made = scene(corner(), beside(5), 250, 0.5, 0.3)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: survey(made.first, made.second, OPTIONS), range(8)))
    for other in found[1:]:
        np.testing.assert_array_equal(overlaps(other), overlaps(found[0]))


def test_kinds_differ() -> None:
    orb = Features("orb", np.zeros((9, 2), np.float32), np.zeros((9, 32), np.uint8))
    found = survey(view(features(9, 0)), view(orb), OPTIONS)
    assert found.outcome is Outcome.KINDS_DIFFER
    assert_sound(found)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_fewer_than_eight_matches(count: int) -> None:
    few = features(count, 0)
    found = survey(view(few), view(few, beside()), OPTIONS)
    assert found.outcome is Outcome.FEW_MATCHES
    assert_sound(found)


def test_all_matches_wrong() -> None:
    one = features(80, 0)
    other = dataclasses.replace(features(80, 1), descriptors=one.descriptors)
    found = survey(view(one), view(other, beside()), OPTIONS)
    assert found.outcome is Outcome.UNVERIFIED
    assert_sound(found)


def test_identical_images_from_one_place_have_no_parallax() -> None:
    same = features(80, 0)
    found = survey(view(same), view(same), OPTIONS)
    assert_sound(found)
    np.testing.assert_allclose(overlaps(found, Outcome.NO_PARALLAX), 1.0, atol=1e-12)


def test_identical_images_from_two_places_come_to_an_end() -> None:
    same = features(80, 0)
    assert_sound(survey(view(same), view(same, beside()), OPTIONS))


def test_back_to_back_nothing_matches() -> None:
    behind = Pose(turn(0, np.pi, 0), np.zeros(3))
    found = survey(view(features(80, 0)), view(features(80, 1), behind), OPTIONS)
    assert found.outcome in (Outcome.FEW_MATCHES, Outcome.UNVERIFIED)
    assert_sound(found)


def test_all_keypoints_at_one_place_or_in_line() -> None:
    line = np.column_stack((np.linspace(10, 600, 60), np.full(60, 200.0))).astype(np.float32)
    for points in (line, np.full((60, 2), 100, np.float32)):
        same = dataclasses.replace(features(60, 0), keypoints_px=points)
        assert_sound(survey(view(same), view(same, beside()), OPTIONS))


def astray(pose: Pose, off_m: tuple[float, float, float] = (0.05, 0.1, 0.0)) -> Pose:
    """A pose reported three degrees and a little way off."""
    return Pose(pose.world_from_camera @ turn(0.04, -0.03, 0.02), pose.centre_m + np.array(off_m))


TURNED = Pose(turn(0.05, 0.2, 0.02), np.zeros(3))
AHEAD = Pose(turn(0, 0.02, 0), np.array([0.0, 0.0, 0.8]))
NARROW = Camera(np.array([[6000.0, 0, 319.5], [0, 6000.0, 239.5], [0, 0, 1]]), 640, 480)


@pytest.mark.parametrize("seed", range(3))
def test_a_camera_that_only_turns_has_no_parallax_and_yet_an_overlap(seed: int) -> None:
    made = scene(corner(), TURNED, 300, 0.4, 0.1, seed)
    found = survey(made.first, made.second, OPTIONS)
    assert_sound(found)
    np.testing.assert_allclose(overlaps(found, Outcome.NO_PARALLAX), truth(made), atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("off_m", [(0.0, 0.0, 0.0), (0.3, 0.05, 0.02)])
def test_a_camera_that_only_turns_is_measured_though_its_pose_be_wrong(
    off_m: tuple[float, float, float], seed: int
) -> None:
    made = scene(corner(), TURNED, 300, 0.4, 0.1, seed)
    found = survey(made.first, dataclasses.replace(made.second, pose=astray(TURNED, off_m)), OPTIONS)
    assert_sound(found)
    # Whichever baseline is taken, planes come out so far away that their homographies are the turn's.
    np.testing.assert_allclose(overlaps(found), truth(made), atol=0.01)


@pytest.mark.parametrize("reported", [AHEAD, astray(AHEAD)], ids=["exact", "astray"])
@pytest.mark.parametrize("planes", [wall(), corner()], ids=["wall", "corner"])
def test_going_forward_is_measured_with_the_epipole_inside_the_image(planes: np.ndarray, reported: Pose) -> None:
    for seed in range(3):
        made = scene(planes, AHEAD, 300, 0.4, 0.1, seed)
        found = survey(made.first, dataclasses.replace(made.second, pose=reported), OPTIONS)
        assert_sound(found)
        np.testing.assert_allclose(overlaps(found), truth(made), atol=0.03)


@pytest.mark.parametrize("off_rad", [0.0, 0.01])
def test_one_plane_through_a_narrow_lens_is_measured_though_no_essential_matrix_is_certain(off_rad: float) -> None:
    beside_it = Pose(turn(0, 0.01, 0), np.array([0.4, 0.02, 0.1]))
    reported = Pose(beside_it.world_from_camera @ turn(off_rad, -off_rad, off_rad / 2), beside_it.centre_m)
    for seed in range(3):
        made = scene(wall(60.0), beside_it, 300, 0.4, 0.1, seed, NARROW)
        found = survey(made.first, dataclasses.replace(made.second, pose=reported), OPTIONS)
        assert_sound(found)
        field = common_field(NARROW, NARROW, *relative(ORIGIN, beside_it), made.planes)
        np.testing.assert_allclose(overlaps(found), [field.overlap_first, field.overlap_second], atol=0.01)


@pytest.mark.parametrize("noise_px", [0.0, 0.4])
def test_everything_far_away_is_answered_by_name(noise_px: float) -> None:
    for seed in range(3):
        made = scene(wall(1e6), beside(seed), 300, noise_px, 0.0, seed)
        found = survey(made.first, made.second, OPTIONS)
        assert_sound(found)
        assert found.outcome in (Outcome.MEASURED, Outcome.NO_PARALLAX)
        np.testing.assert_allclose(overlaps(found, found.outcome), truth(made), atol=0.01)


def test_opposite_sides_of_a_wall_have_nothing_in_common() -> None:
    behind = Pose(turn(0, np.pi, 0), np.array([0.0, 0.0, 12.0]))
    marks = features(80, 0)
    found = survey(view(marks), view(marks, behind), OPTIONS)
    assert_sound(found)
    assert found.outcome is Outcome.UNVERIFIED
