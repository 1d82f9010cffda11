import numpy as np
import pytest
from covista_service.perception import frustum
from covista_service.perception.camera import Pose

from tests.service.perception.scenes import CAMERA, ORIGIN, turn

FAR = (0.1, float("inf"))
BACK = Pose(turn(0, np.pi, 0), np.array([0.0, 0.0, -1.0]))


def test_the_same_pose_shares_all_and_back_to_back_nothing() -> None:
    assert frustum.overlap(CAMERA, ORIGIN, 5, CAMERA, ORIGIN, 5) == pytest.approx((1.0, 1.0))
    assert frustum.overlap(CAMERA, ORIGIN, 5, CAMERA, BACK, 5) == (0.0, 0.0)


def test_a_step_aside_at_twice_the_depth_costs_half() -> None:
    beside = Pose(np.eye(3), np.array([1.0, 0.0, 0.0]))
    near, far = (frustum.overlap(CAMERA, ORIGIN, depth, CAMERA, beside, depth)[0] for depth in (5, 10))
    assert 1 - near == pytest.approx(500 / 5 / 640)
    assert 1 - far == pytest.approx((1 - near) / 2)


def test_swapping_swaps_and_the_world_frame_does_not_matter() -> None:
    other = Pose(turn(0.1, 0.3, 0.05), np.array([1.0, 0.2, 0.5]))
    there = frustum.overlap(CAMERA, ORIGIN, 4, CAMERA, other, 6)
    assert frustum.overlap(CAMERA, other, 6, CAMERA, ORIGIN, 4) == pytest.approx(there[::-1])
    world = turn(1, 2, 3)
    moved = [Pose(world @ pose.world_from_camera, world @ pose.centre_m + 7) for pose in (ORIGIN, other)]
    assert frustum.overlap(CAMERA, moved[0], 4, CAMERA, moved[1], 6) == pytest.approx(there)


@pytest.mark.parametrize("reach", [FAR, (0.1, 5.0)])
def test_frusta_that_share_a_point_may_meet(reach: tuple[float, float]) -> None:
    random = np.random.default_rng(2)
    shared = 0
    for _ in range(200):
        other = Pose(turn(*random.uniform(-3, 3, 3)), random.uniform(-4, 4, 3))
        points = random.uniform(-6, 6, (400, 3))
        if (_inside(ORIGIN, points, reach) & _inside(other, points, reach)).any():
            shared += 1
            assert frustum.may_meet(CAMERA, ORIGIN, reach, CAMERA, other, reach)
    assert shared > 10


def test_frusta_apart_cannot_meet() -> None:
    assert not frustum.may_meet(CAMERA, ORIGIN, FAR, CAMERA, BACK, FAR)
    beyond = Pose(np.eye(3), np.array([0.0, 0.0, 7.0]))
    assert not frustum.may_meet(CAMERA, ORIGIN, (0.1, 5.0), CAMERA, beyond, FAR)
    assert frustum.may_meet(CAMERA, ORIGIN, FAR, CAMERA, beyond, FAR)


def _inside(pose: Pose, points: np.ndarray, reach: tuple[float, float]) -> np.ndarray:
    seen = (points - pose.centre_m) @ pose.world_from_camera
    ahead = (seen[:, 2] > reach[0]) & (seen[:, 2] < reach[1])
    v = seen @ CAMERA.matrix.T / np.where(ahead, seen[:, 2], 1)[:, None]
    return ahead & (v[:, 0] > -0.5) & (v[:, 0] < 639.5) & (v[:, 1] > -0.5) & (v[:, 1] < 479.5)
