"""Doubt about poses, the boxes around views, and how much a view changes."""

import numpy as np
import pytest
from covista_service.perception.camera import Pose
from covista_service.perception.extent import EXACT, UNTOLD, Doubt, box_of, change
from covista_service.perception.frustum import Frustum
from hypothesis import given
from hypothesis import strategies as st

from tests.service.perception.scenes import CAMERA, ORIGIN, turn

angles = st.floats(-np.pi, np.pi)
metres = st.floats(-20, 20)
depths = st.tuples(st.floats(0.1, 3), st.floats(3, 30))


def seen(pose: Pose, near_far_m: tuple[float, float], seed: int) -> np.ndarray:
    """Points (n, 3) in the world that a camera sees between two depths."""
    random = np.random.default_rng(seed)
    edges = random.choice([0.0, 1.0], (40, 2))
    share = np.vstack((edges, random.uniform(0, 1, (40, 2))))
    px = share * (CAMERA.width, CAMERA.height) - 0.5
    rays = np.column_stack((px, np.ones(len(px)))) @ CAMERA.rays_from_pixels.T
    return rays * random.uniform(*near_far_m, (len(px), 1)) @ pose.world_from_camera.T + pose.centre_m


def holds(frustum: Frustum, points: np.ndarray) -> bool:
    return bool((points @ frustum.normals.T <= frustum.offsets + frustum.margin_m + 1e-6).all())


@given(
    st.tuples(angles, angles, angles),
    st.tuples(metres, metres, metres),
    st.tuples(*[st.floats(-1, 1)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 3),
    st.floats(0, 0.5),
    st.floats(0, 3),
    depths,
    st.integers(0, 100),
)
def test_a_grown_frustum_holds_what_every_pose_within_the_doubt_sees(
    attitude, place, axis, way, angle, off_m, reach, seed
) -> None:
    told = Pose(turn(*attitude), np.array(place))
    length = np.linalg.norm(axis)
    off = rotation(np.array(axis) / length, angle) if length > 1e-3 else np.eye(3)
    step = np.array(way) / max(np.linalg.norm(way), 1.0) * off_m
    true = Pose(told.world_from_camera @ off, told.centre_m + step)
    assert holds(Frustum(CAMERA, told, reach, angle, off_m), seen(true, reach, seed))


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@given(
    st.tuples(angles, angles, angles), st.tuples(metres, metres, metres), depths, st.floats(0, 2), st.integers(0, 99)
)
def test_what_is_seen_lies_in_the_box(attitude, place, reach, margin_m, seed) -> None:
    pose = Pose(turn(*attitude), np.array(place))
    for far in (reach[1], np.inf):
        frustum = Frustum(CAMERA, pose, (reach[0], far))
        low, high = box_of(frustum.corners, frustum.directions, margin_m)
        points = seen(pose, reach, seed)
        assert (points >= np.array(low) + margin_m - 1e-6).all()
        assert (points <= np.array(high) - margin_m + 1e-6).all()


def test_no_doubt_changes_nothing() -> None:
    exact, plain = Frustum(CAMERA, ORIGIN, (1, 5), 0.0, 0.0), Frustum(CAMERA, ORIGIN, (1, 5))
    np.testing.assert_array_equal(exact.corners, plain.corners)
    assert EXACT.off_m(4.0) == 0.0


def test_margins_let_frusta_meet_that_would_just_miss_each_other() -> None:
    there = Pose(np.eye(3), np.array([0.0, 0.0, 5.5]))
    reach = (1.0, 6.0)
    one, other = Frustum(CAMERA, ORIGIN, reach), Frustum(CAMERA, there, reach)
    assert not one.may_meet(other)
    assert Frustum(CAMERA, ORIGIN, reach, 0.0, 0.6).may_meet(other)
    assert other.may_meet(Frustum(CAMERA, ORIGIN, reach, 0.0, 0.6))
    assert not Frustum(CAMERA, ORIGIN, reach, 0.0, 0.2).may_meet(Frustum(CAMERA, there, reach, 0.0, 0.2))


def test_a_covariance_counts_with_two_deviations_of_its_worst_axis() -> None:
    covariance = np.diag([0.01, 0.04, 0.0, 0.0, 1e-4, 0.0])
    doubt = Doubt.of(covariance)
    assert doubt.distance_m == pytest.approx(0.4)
    assert doubt.angle_rad == pytest.approx(0.02)
    assert doubt.depth_share == 0.0
    around = np.kron(np.eye(2), turn(0.3, 1.0, -0.4))
    turned = Doubt.of(around @ covariance @ around.T)
    assert (turned.distance_m, turned.angle_rad) == pytest.approx((0.4, 0.02))


@pytest.mark.parametrize("wild", [np.full((6, 6), -1.0), -np.eye(6), np.full((6, 6), 1e308), np.triu(np.ones((6, 6)))])
def test_what_is_no_covariance_makes_a_doubt_all_the_same(wild: np.ndarray) -> None:
    doubt = Doubt.of(wild)
    assert np.isfinite([doubt.angle_rad, doubt.distance_m]).all()
    assert doubt.distance_m >= 0
    assert 0 <= doubt.angle_rad <= np.pi / 4


def test_a_doubt_is_no_less_than_what_corrections_say() -> None:
    assert UNTOLD.at_least(0.01, 0.5).angle_rad == UNTOLD.angle_rad
    assert UNTOLD.at_least(0.2, 0.5).angle_rad == 0.2
    assert UNTOLD.at_least(9.0, 0.5).angle_rad == np.pi / 4
    assert UNTOLD.at_least(0.2, 0.5).off_m(10.0) == pytest.approx(0.8)


def test_a_turn_counts_as_a_share_of_the_field_and_a_way_as_one_of_the_depth() -> None:
    field = 2 * np.arctan(CAMERA.width / 2 / CAMERA.matrix[0, 0])
    turned = Pose(turn(0.0, field / 2, 0.0), np.zeros(3))
    moved = Pose(np.eye(3), np.array([0.0, 3.0, 0.0]))
    assert change(CAMERA, ORIGIN, ORIGIN, 4.0) == 0.0
    assert change(CAMERA, ORIGIN, turned, 4.0) == pytest.approx(0.5)
    assert change(CAMERA, ORIGIN, moved, 4.0) == pytest.approx(0.75)
    assert change(CAMERA, ORIGIN, moved, None) == 0.0
    assert change(CAMERA, ORIGIN, Pose(turn(0.0, np.pi, 0.0), np.zeros(3)), 4.0) == pytest.approx(np.pi / field)
