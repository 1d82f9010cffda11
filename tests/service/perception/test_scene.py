import warnings

import numpy as np
import pytest
from covista_service.perception.camera import Camera, Features, Pose, View
from covista_service.perception.frustum import overlap
from covista_service.perception.scene import Scene, SceneOptions, reconstruct

from tests.service.perception.scenes import CAMERA, turn
from tests.service.perception.swarms import moved, points_on_wall, side_by_side, views

OPTIONS = SceneOptions()
POSES = side_by_side(4)
FACING = points_on_wall(slope=0.0)
ALL = [(i, j) for i in range(4) for j in range(i + 1, 4)]


def overlaps(scene: Scene) -> list[tuple[float, float] | None]:
    return [scene.overlap(*pair) for pair in ALL]


def test_a_wall_is_measured_by_every_pair() -> None:
    poses = [Pose(np.eye(3), np.array([1.0 * k, 0, 0])) for k in range(4)]
    scene = reconstruct(views(FACING, poses), ALL, OPTIONS)
    for i, j in ALL:
        expected = overlap(CAMERA, poses[i], 6.0, CAMERA, poses[j], 6.0)
        assert scene.overlap(i, j) == pytest.approx(expected, abs=0.03)


@pytest.mark.parametrize("scale", [0.1, 10.0])
def test_scaling_all_baselines_changes_nothing(scale: float) -> None:
    seen = views(points_on_wall(), POSES, noise_px=0.3)
    scaled = [moved(view, Pose(view.pose.world_from_camera, scale * view.pose.centre_m)) for view in seen]
    one, other = overlaps(reconstruct(seen, ALL, OPTIONS)), overlaps(reconstruct(scaled, ALL, OPTIONS))
    assert np.array(one, float) == pytest.approx(np.array(other, float), abs=1e-9)


def test_moving_the_world_changes_nothing() -> None:
    seen = views(points_on_wall(), POSES, noise_px=0.3)
    rotation, shift = turn(0.3, -0.8, 0.4), np.array([5.0, -7.0, 2.0])
    elsewhere = [
        moved(view, Pose(rotation @ view.pose.world_from_camera, rotation @ view.pose.centre_m + shift))
        for view in seen
    ]
    one, other = overlaps(reconstruct(seen, ALL, OPTIONS)), overlaps(reconstruct(elsewhere, ALL, OPTIONS))
    assert np.array(one, float) == pytest.approx(np.array(other, float), abs=2e-3)


def test_wrong_poses_are_mended_by_the_images() -> None:
    seen = views(points_on_wall(600), POSES, noise_px=0.3)
    random = np.random.default_rng(3)
    wrong = [
        moved(
            view,
            Pose(
                turn(*random.normal(0, 0.03, 3)) @ view.pose.world_from_camera,
                view.pose.centre_m + random.normal(0, 0.1, 3),
            ),
        )
        for view in seen
    ]
    right, mended = overlaps(reconstruct(seen, ALL, OPTIONS)), overlaps(reconstruct(wrong, ALL, OPTIONS))
    assert np.array(mended, float) == pytest.approx(np.array(right, float), abs=0.03)


def test_a_keyframe_that_matches_nobody_is_predicted() -> None:
    seen = views(FACING, POSES)
    random = np.random.default_rng(0)
    strange = Features(
        "rootsift",
        seen[3].features.keypoints_px,
        random.integers(0, 90, (len(seen[3].features.keypoints_px), 128)).astype(np.uint8),
    )
    scene = reconstruct([*seen[:3], View(CAMERA, POSES[3], strange)], ALL, OPTIONS)
    expected = reconstruct(seen, ALL, OPTIONS)
    assert scene.matched[2, 3] == 0
    assert scene.overlap(2, 3) == pytest.approx(expected.overlap(2, 3), abs=0.1)


def none(count: int = 0, width: int = 128) -> Features:
    return Features("rootsift", np.zeros((count, 2), np.float32), np.zeros((count, width), np.uint8))


@pytest.mark.parametrize(
    "features",
    [none(), none(3), none(50), Features("orb", np.zeros((50, 2), np.float32), np.zeros((50, 32), np.uint8))],
    ids=["no features", "three alike", "fifty alike", "another kind"],
)
def test_hopeless_keyframes_disturb_nobody(features: Features) -> None:
    seen = views(FACING, POSES[:3])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = reconstruct([*seen, View(CAMERA, POSES[3], features)], ALL, OPTIONS)
        found = overlaps(scene)
    assert found[0] == reconstruct(seen, [(0, 1), (0, 2), (1, 2)], OPTIONS).overlap(0, 1)
    assert all(shares is None or np.isfinite(shares).all() for shares in found)


def test_without_any_match_there_is_no_answer() -> None:
    alone = [View(CAMERA, pose, none()) for pose in POSES]
    assert overlaps(reconstruct(alone, ALL, OPTIONS)) == [None] * 6


def test_robots_in_one_place_see_the_same() -> None:
    seen = views(FACING, [POSES[0], POSES[1]])
    scene = reconstruct([seen[0], seen[0], seen[1]], [(0, 1), (0, 2), (1, 2)], OPTIONS)
    assert scene.overlap(0, 1) == (1.0, 1.0)


def test_robots_in_one_place_do_not_spoil_the_adjustment_of_others() -> None:
    first, second, third = views(points_on_wall(600), POSES[:3], noise_px=0.3)
    turned = moved(third, Pose(third.pose.world_from_camera @ turn(0, 0.06, 0), third.pose.centre_m))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = reconstruct([first, first, turned, second], ALL, OPTIONS)
    assert scene.overlap(0, 1) == (1.0, 1.0)
    right = reconstruct([first, third, second], [(0, 1), (0, 2), (1, 2)], OPTIONS).overlap(0, 1)
    assert scene.overlap(0, 2) == pytest.approx(right, abs=0.03)


def test_cameras_of_other_sizes_agree() -> None:
    half = Camera(np.diag([0.5, 0.5, 1.0]) @ CAMERA.matrix, CAMERA.width // 2, CAMERA.height // 2)
    large, small = views(FACING, POSES), views(FACING, POSES, camera=half)
    mixed = reconstruct([large[0], small[1]], [(0, 1)], OPTIONS).overlap(0, 1)
    assert mixed == pytest.approx(reconstruct(large[:2], [(0, 1)], OPTIONS).overlap(0, 1), abs=0.03)


def test_swapping_two_keyframes_swaps_their_shares() -> None:
    one, other = views(points_on_wall(), POSES[:2], noise_px=0.3)
    forth = reconstruct([one, other], [(0, 1)], OPTIONS).overlap(0, 1)
    back = reconstruct([other, one], [(0, 1)], OPTIONS).overlap(0, 1)
    assert forth is not None
    assert back is not None
    assert forth == pytest.approx(back[::-1], abs=2e-3)


def test_opposite_sides_of_a_wall_have_nothing_in_common() -> None:
    """Two cameras on either side: whatever their images match, nobody sees the side that another looks at."""
    wall = points_on_wall(900, slope=0.0)
    beyond = [Pose(turn(0, np.pi, 0), np.array([x, 0, 12.0])) for x in (0.0, -1.0)]
    front = views(wall, [Pose(np.eye(3), np.array([x, 0, 0])) for x in (0.0, 1.0)], noise_px=0.3)
    back = [
        View(view.camera, view.pose, Features("rootsift", view.features.keypoints_px, 255 - view.features.descriptors))
        for view in views(wall, beyond, noise_px=0.3)
    ]
    scene = reconstruct([*front, *back], ALL, OPTIONS)
    assert scene.matched[0, 2] == 0
    seen = scene.overlap(0, 1)
    assert seen is not None
    assert min(seen) > 0.7
    assert scene.overlap(0, 2) == pytest.approx((0, 0), abs=0.03)
