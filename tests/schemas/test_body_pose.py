"""A robot that says where its body is, and where its camera sits on it."""

import numpy as np
import pytest
from covista_schemas import codec
from covista_schemas import robot_pb2 as pb
from covista_schemas.errors import DecodeError
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.schemas.strategies import quaternions

positions = st.tuples(*[st.floats(-100, 100)] * 3)
transforms = st.tuples(positions, quaternions())
Transform = tuple[tuple[float, float, float], tuple[float, float, float, float]]


def wire(transform: Transform) -> pb.Transform:
    return pb.Transform(position_m=transform[0], orientation_xyzw=transform[1])


def matrix(transform: Transform) -> NDArray[np.float64]:
    made = np.eye(4)
    made[:3, :3] = Rotation.from_quat(transform[1]).as_matrix()
    made[:3, 3] = transform[0]
    return made


@given(transforms, transforms)
@settings(deadline=None)
def test_body_and_mount_compose_to_the_camera(world_from_body: Transform, body_from_camera: Transform) -> None:
    message = pb.Pose(
        robot="r1", boot="b", world_from_body=wire(world_from_body), body_from_camera=wire(body_from_camera)
    )
    pose = codec.decode_pose(message.SerializeToString()).pose
    expected = matrix(world_from_body) @ matrix(body_from_camera)
    np.testing.assert_allclose(matrix((pose.position_m, pose.orientation_xyzw)), expected, atol=1e-11)


@given(transforms)
@settings(deadline=None)
def test_without_a_mount_the_camera_is_the_body(world_from_body: Transform) -> None:
    message = pb.Pose(robot="r1", boot="b", world_from_body=wire(world_from_body))
    pose = codec.decode_pose(message.SerializeToString()).pose
    np.testing.assert_allclose(pose.position_m, world_from_body[0])
    np.testing.assert_allclose(pose.orientation_xyzw, world_from_body[1], atol=1e-15)


@pytest.mark.parametrize("part", ["world_from_body", "body_from_camera"])
def test_the_wrong_part_is_named(part: str) -> None:
    good = wire(((1, 2, 3), (0, 0, 0, 1)))
    message = pb.Pose(robot="r1", boot="b", world_from_body=good, body_from_camera=good)
    getattr(message, part).orientation_xyzw[3] = 0.5
    with pytest.raises(DecodeError) as caught:
        codec.decode_pose(message.SerializeToString())
    assert (caught.value.code, caught.value.field) == (codec.BAD_POSE, f"{part}.orientation_xyzw")
