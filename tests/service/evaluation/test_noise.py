from __future__ import annotations

import numpy as np
import pytest
from covista_service.evaluation.noise import NO_NOISE, PoseNoise, disturbed
from covista_service.perception.camera import Pose

REPORTED = Pose(np.eye(3), np.array([1.0, 2.0, 3.0]))


def test_errors_are_as_large_as_asked() -> None:
    rng = np.random.default_rng(0)
    poses = [disturbed(REPORTED, PoseNoise(3.0, 0.03), 20.0, rng) for _ in range(3000)]
    degrees = np.degrees([np.arccos(np.clip((np.trace(pose.world_from_camera) - 1) / 2, -1, 1)) for pose in poses])
    shifts = np.linalg.norm([pose.centre_m - REPORTED.centre_m for pose in poses], axis=1)
    assert np.sqrt(np.mean(degrees**2)) == pytest.approx(3.0, rel=0.05)
    assert np.sqrt(np.mean(shifts**2)) == pytest.approx(0.6, rel=0.05)


def test_poses_stay_rigid_and_seeds_repeat() -> None:
    first, again = (disturbed(REPORTED, PoseNoise(5, 0.1), 2.0, np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_allclose(first.world_from_camera.T @ first.world_from_camera, np.eye(3), atol=1e-12)
    np.testing.assert_array_equal(first.world_from_camera, again.world_from_camera)
    np.testing.assert_array_equal(first.centre_m, again.centre_m)


def test_no_noise_changes_nothing() -> None:
    same = disturbed(REPORTED, NO_NOISE, 20.0, np.random.default_rng(0))
    np.testing.assert_array_equal(same.world_from_camera, REPORTED.world_from_camera)
    np.testing.assert_array_equal(same.centre_m, REPORTED.centre_m)
    assert NO_NOISE.is_none
    assert not PoseNoise(0, 0.1).is_none
