import threading
from dataclasses import replace

import numpy as np
import pytest
from covista_service.perception.camera import Floats, Pose, relative
from covista_service.perception.relative_pose import RelativePose, RelativePoseOptions, relative_pose
from covista_service.perception.sightings import Sightings

from tests.service.perception.scenes import CAMERA, ORIGIN, beside, corner, scene, turn

OPTIONS = RelativePoseOptions()


def sightings(outliers: float, seed: int = 0, count: int = 200) -> Sightings:
    """Matches in a corner, half a pixel off, and a share of matches that are wrong altogether."""
    made = scene(corner(), beside(seed), count, noise_px=0.4, seed=seed).sightings()
    random = np.random.default_rng(seed)
    second_px = made.second_px.copy()
    wrong = random.random(len(second_px)) < outliers
    second_px[wrong] = random.uniform([0, 0], [640, 480], (int(wrong.sum()), 2))
    return replace(made, second_px=second_px)


def angle_deg(one: Floats, other: Floats) -> float:
    return float(np.degrees(np.arccos(np.clip((np.trace(one @ other.T) - 1) / 2, -1, 1))))


def astray(pose: Pose, seed: int) -> Pose:
    """The pose with 3 degrees and 0.1 m of error."""
    random = np.random.default_rng(seed)
    axis = random.normal(size=3)
    return Pose(
        pose.world_from_camera @ turn(*(np.radians(3) * axis / np.linalg.norm(axis))),
        pose.centre_m + random.normal(0, 0.1, 3),
    )


@pytest.mark.parametrize("seed", range(6))
def test_the_reported_pose_stands_where_the_images_agree(seed: int) -> None:
    rotation, translation = relative(ORIGIN, beside(seed))
    found = relative_pose(sightings(0.3, seed), rotation, translation, OPTIONS, 0)
    assert found.source == "reported"
    assert found.verified
    np.testing.assert_array_equal(found.rotation, rotation)


@pytest.mark.parametrize("seed", range(6))
def test_the_images_correct_a_pose_and_leave_the_baseline_its_length(seed: int) -> None:
    rotation, translation = relative(ORIGIN, beside(seed))
    reported = relative(ORIGIN, astray(beside(seed), seed))
    found = relative_pose(sightings(0.3, seed), *reported, OPTIONS, 0)
    assert (found.source, found.verified) == ("images", True)
    assert angle_deg(found.rotation, rotation) < min(0.5, angle_deg(reported[0], rotation))
    assert np.linalg.norm(found.translation) == pytest.approx(np.linalg.norm(reported[1]))
    direction = found.translation / np.linalg.norm(found.translation)
    assert direction @ translation / np.linalg.norm(translation) > 0.97


def test_the_sign_of_the_baseline_comes_from_the_images() -> None:
    rotation, translation = relative(ORIGIN, beside(1))
    found = relative_pose(sightings(0.2, 1), rotation, -translation, OPTIONS, 0)
    assert found.source == "images"
    assert found.translation @ translation > 0


def test_robots_that_report_one_place_get_a_direction_all_the_same() -> None:
    rotation, translation = relative(ORIGIN, beside(2))
    found = relative_pose(sightings(0.2, 2), rotation, np.zeros(3), OPTIONS, 0)
    assert (found.source, found.verified) == ("images", True)
    assert found.translation @ translation > 0


def test_wrong_matches_verify_nothing() -> None:
    rotation, translation = relative(ORIGIN, beside())
    found = relative_pose(sightings(1.0), rotation, translation, OPTIONS, 0)
    assert (found.source, found.verified) == ("reported", False)


@pytest.mark.parametrize("count", [0, 1, 5, 7])
def test_few_matches_leave_the_reported_pose(count: int) -> None:
    rotation, translation = relative(ORIGIN, beside())
    found = relative_pose(sightings(0.0, count=count), rotation, translation, OPTIONS, 0)
    assert (found.source, found.verified) == ("reported", False)


def test_points_in_line_leave_the_reported_pose() -> None:
    line = np.column_stack((np.linspace(0, 600, 40), np.linspace(100, 130, 40)))
    rotation, translation = relative(ORIGIN, beside())
    found = relative_pose(Sightings(CAMERA, CAMERA, line, line + 20), rotation, translation, OPTIONS, 0)
    assert np.isfinite(found.translation).all()


def test_the_same_seed_gives_the_same_pose_in_every_thread() -> None:
    reported = relative(ORIGIN, astray(beside(3), 3))
    matches = sightings(0.5, 3)
    found: list[RelativePose] = []
    threads = [
        threading.Thread(target=lambda: found.append(relative_pose(matches, *reported, OPTIONS, 7))) for _ in range(6)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 6
    for other in found[1:]:
        np.testing.assert_array_equal(other.rotation, found[0].rotation)
        np.testing.assert_array_equal(other.translation, found[0].translation)
