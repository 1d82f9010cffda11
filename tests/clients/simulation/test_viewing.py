from __future__ import annotations

import math

import numpy as np
import pytest
from covista_clients.simulation.viewing import facing, looking_at, pinhole, ray_from_pixel, world_from_camera
from covista_schemas.messages import Distortion

from .oracle import turned


@pytest.mark.parametrize("yaw", [-3.0, -0.5, 0.0, 1.0, 3.1])
@pytest.mark.parametrize("pitch", [-1.2, 0.0, 0.4])
def test_cameras_stand_upright_and_look_where_told(yaw: float, pitch: float) -> None:
    right, down, forward = world_from_camera(facing((1.0, 2.0, 3.0), yaw, pitch)).T
    expected = (math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch))
    np.testing.assert_allclose(forward, expected, atol=1e-12)
    assert abs(right[2]) < 1e-12
    assert down[2] < 0
    np.testing.assert_allclose(np.cross(right, down), forward, atol=1e-12)


def test_the_matrix_turns_vectors_as_the_quaternion_does() -> None:
    pose = facing((0.0, 0.0, 0.0), 0.7, -0.3)
    np.testing.assert_allclose(world_from_camera(pose) @ np.eye(3), turned(pose, np.eye(3)).T, atol=1e-12)


def test_what_is_looked_at_stands_in_the_middle() -> None:
    pose = looking_at((1.0, -2.0, 1.0), (4.0, 3.0, 0.5))
    way = world_from_camera(pose).T @ np.array((3.0, 5.0, -0.5))
    np.testing.assert_allclose(way / np.linalg.norm(way), (0, 0, 1), atol=1e-12)


def test_the_outermost_rays_span_the_field_of_view() -> None:
    camera = pinhole(320, 240, 65)
    left, right = (ray_from_pixel(camera) @ (x, 119.5, 1) for x in (-0.5, 319.5))
    angle = math.degrees(math.atan(right[0]) - math.atan(left[0]))
    assert angle == pytest.approx(65)


def test_lenses_are_refused() -> None:
    lens = pinhole().model_copy(update={"distortion": Distortion(model="plumb_bob", coefficients=(0.1, 0, 0, 0))})
    with pytest.raises(ValueError, match="plumb_bob"):
        ray_from_pixel(lens)
