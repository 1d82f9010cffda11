import numpy as np
import pytest
from covista_service.perception.camera import Camera, Pose, relative, relatives, rotation_of, undistort

from tests.service.perception.scenes import CAMERA, turn


def test_rays_are_the_inverse_of_pixels_with_skew_too() -> None:
    for skew in (0.0, 3.0):
        camera = Camera(np.array([[500.0, skew, 320], [0, 480.0, 240], [0, 0, 1]]), 640, 480)
        np.testing.assert_allclose(camera.rays_from_pixels @ camera.matrix, np.eye(3), atol=1e-12)


def test_relative_pose_takes_points_from_one_camera_to_the_other() -> None:
    one, other = Pose(turn(0.1, 0.2, 0.3), np.array([1.0, 2, 3])), Pose(turn(-1, 0.5, 2), np.array([0.0, 1, -1]))
    rotation, translation = relative(one, other)
    in_first = np.array([0.5, -0.2, 4.0])
    world = one.world_from_camera @ in_first + one.centre_m
    in_second = other.world_from_camera.T @ (world - other.centre_m)
    np.testing.assert_allclose(rotation @ in_first + translation, in_second, atol=1e-12)


def test_relative_poses_of_many_are_those_of_each() -> None:
    random = np.random.default_rng(0)
    poses = [Pose(turn(*random.normal(0, 1, 3)), random.normal(0, 3, 3)) for _ in range(5)]
    pairs = np.array([(i, j) for i in range(5) for j in range(5)])
    rotations, translations = relatives(poses, pairs)
    for (i, j), rotation, translation in zip(pairs, rotations, translations, strict=True):
        np.testing.assert_allclose(rotation, relative(poses[i], poses[j])[0], atol=1e-12)
        np.testing.assert_allclose(translation, relative(poses[i], poses[j])[1], atol=1e-12)
    assert [len(none) for none in relatives(poses, np.zeros((0, 2), np.intp))] == [0, 0]


def test_a_quarter_turn() -> None:
    half = np.sqrt(0.5)
    np.testing.assert_allclose(rotation_of((0, 0, half, half)) @ [1, 0, 0], [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize(
    "camera",
    [
        CAMERA,
        Camera(CAMERA.matrix, 640, 480, "plumb_bob", (0.1, -0.05, 0.001, 0.0)),
        Camera(CAMERA.matrix, 640, 480, "equidistant", (0.01, 0.0, 0.0, 0.0)),
    ],
)
def test_undistorting_keeps_the_principal_point_and_the_shape(camera: Camera) -> None:
    points = np.array([[319.5, 239.5], [100.0, 80.0]])
    ideal = undistort(camera, points)
    np.testing.assert_allclose(ideal[0], points[0], atol=1e-6)
    assert np.isfinite(ideal).all()
    assert undistort(camera, np.zeros((0, 2))).shape == (0, 2)
