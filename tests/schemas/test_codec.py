import contextlib
import pickle
from dataclasses import replace

import numpy as np
import pytest
from covista_schemas import codec
from covista_schemas import robot_pb2 as pb
from covista_schemas.errors import CovistaError, DecodeError
from covista_schemas.messages import Keyframe, Pose, PoseUpdate
from google.protobuf.message import Message
from hypothesis import given, settings

from tests.schemas.strategies import keyframes, pose_updates


def assert_same_pose(one: Pose, other: Pose) -> None:
    assert one.position_m == other.position_m
    assert one.time_ns == other.time_ns
    assert one.covariance == other.covariance
    np.testing.assert_allclose(one.orientation_xyzw, other.orientation_xyzw, atol=1e-15)


@given(keyframes(), pose_updates)
@settings(deadline=None)
def test_a_picture_that_is_encoded_before_its_name_makes_the_same_keyframe(
    keyframe: Keyframe, update: PoseUpdate
) -> None:
    if keyframe.features is None:
        return
    picture = codec.encode_picture(keyframe.camera, keyframe.features, keyframe.thumbnail)
    data = codec.encode_taken(update, picture)
    named = replace(keyframe, robot=update.robot, boot=update.boot, sequence=update.sequence, pose=update.pose)
    assert codec.peek_keyframe(data) == (update.robot, update.boot, update.sequence)
    assert pb.Keyframe.FromString(data) == pb.Keyframe.FromString(codec.encode_keyframe(named))


@given(keyframes())
@settings(deadline=None)
def test_keyframes_come_back_as_they_went(keyframe: Keyframe) -> None:
    back = codec.decode_keyframe(codec.encode_keyframe(keyframe), robot=keyframe.robot)
    assert (back.robot, back.boot, back.sequence) == (keyframe.robot, keyframe.boot, keyframe.sequence)
    assert (back.camera, back.image, back.thumbnail) == (keyframe.camera, keyframe.image, keyframe.thumbnail)
    assert_same_pose(back.pose, keyframe.pose)
    if keyframe.features is None:
        assert back.features is None
        return
    assert back.features is not None
    assert back.features.kind is keyframe.features.kind
    np.testing.assert_array_equal(back.features.keypoints_px, keyframe.features.keypoints_px)
    np.testing.assert_array_equal(back.features.descriptors, keyframe.features.descriptors)


@given(pose_updates)
@settings(deadline=None)
def test_poses_come_back_as_they_went(update: PoseUpdate) -> None:
    back = codec.decode_pose(codec.encode_pose(update), robot=update.robot)
    assert (back.robot, back.boot, back.sequence) == (update.robot, update.boot, update.sequence)
    assert_same_pose(back.pose, update.pose)


@given(keyframes())
@settings(deadline=None)
def test_a_peek_reads_the_name_that_decoding_reads(keyframe: Keyframe) -> None:
    name = keyframe.robot, keyframe.boot, keyframe.sequence
    assert codec.peek_keyframe(codec.encode_keyframe(keyframe), robot=keyframe.robot) == name
    update = PoseUpdate(*name, keyframe.pose)
    assert codec.peek_pose(codec.encode_pose(update), robot=keyframe.robot) == name


@given(keyframes())
@settings(deadline=None)
def test_what_is_cut_short_is_refused_or_still_a_keyframe(keyframe: Keyframe) -> None:
    data = codec.encode_keyframe(keyframe)
    for length in range(0, len(data), 7):
        with contextlib.suppress(DecodeError):
            codec.decode_keyframe(data[:length])


@pytest.mark.parametrize("data", [b"\xff", b"\x00" * 10, b"no protobuf at all", b"\x0a\x02\xff\xfe"])
def test_what_is_no_message_is_malformed(data: bytes) -> None:
    for read in (codec.decode_keyframe, codec.decode_pose, codec.peek_keyframe, codec.peek_pose):
        with pytest.raises(DecodeError) as caught:
            read(data)
        assert caught.value.code == codec.MALFORMED
        assert caught.value.field == "payload"


def test_fields_of_later_versions_are_passed_over() -> None:
    later = pb.Keyframe(robot="r1", boot="b", image=b"...", camera=good_camera(), world_from_camera=good_transform())
    # Field 100, of two bytes.
    data = later.SerializeToString() + b"\xa2\x06\x02hi"
    assert codec.decode_keyframe(data).image == b"..."
    assert codec.peek_keyframe(data) == ("r1", "b", 0)


def test_float_descriptors_are_quantised() -> None:
    message = good_keyframe()
    values = np.random.default_rng(0).uniform(0, 0.3, (2, 128)).astype("<f4")
    message.features.kind = "rootsift"
    message.features.descriptors = values.tobytes()
    features = codec.decode_keyframe(message.SerializeToString()).features
    assert features is not None
    np.testing.assert_allclose(features.descriptors / 512, values, atol=0.5 / 512 + 1e-6)


def test_errors_cross_processes_whole() -> None:
    error = DecodeError(codec.BAD_POSE, "world_from_camera", "no pose given")
    again = pickle.loads(pickle.dumps(error))
    assert isinstance(again, CovistaError)
    assert (again.code, again.field, again.reason, str(again)) == (error.code, error.field, error.reason, str(error))


def good_camera() -> pb.Camera:
    return pb.Camera(fx=100, fy=100, cx=50, cy=40, width=100, height=80)


def good_transform() -> pb.Transform:
    return pb.Transform(position_m=[1, 2, 3], orientation_xyzw=[0, 0, 0, 1])


def good_keyframe() -> pb.Keyframe:
    points = np.array([[1, 2], [99, 79]], "<f4").tobytes()
    return pb.Keyframe(
        robot="r1",
        boot="b",
        camera=good_camera(),
        world_from_camera=good_transform(),
        features=pb.Features(kind="orb", count=2, keypoints=points, descriptors=bytes(64)),
    )


def set_to(path: str, value: object) -> object:
    """A change of one field of a good keyframe."""

    def change(message: Message) -> None:
        *parents, name = path.split(".")
        for parent in parents:
            message = getattr(message, parent)
        if isinstance(value, list):
            del getattr(message, name)[:]
            getattr(message, name).extend(value)
        else:
            setattr(message, name, value)

    return change


def points_at(*points: tuple[float, float]) -> bytes:
    return np.array(points, "<f4").tobytes()


NAN, INF = float("nan"), float("inf")
WRONG = [
    (set_to("robot", "R1"), codec.WRONG_ID, "robot"),
    (set_to("robot", "r2"), codec.WRONG_ID, "robot"),
    (set_to("robot", ""), codec.WRONG_ID, "robot"),
    (set_to("boot", "no/boot"), codec.WRONG_ID, "boot"),
    (set_to("boot", "b\n"), codec.WRONG_ID, "boot"),
    (set_to("camera.fx", 0.0), codec.BAD_CAMERA, "camera.fx"),
    (set_to("camera.fx", -100.0), codec.BAD_CAMERA, "camera.fx"),
    (set_to("camera.fy", NAN), codec.BAD_CAMERA, "camera.fy"),
    (set_to("camera.fy", 5e-324), codec.BAD_CAMERA, "camera.fy"),
    (set_to("camera.cx", INF), codec.BAD_CAMERA, "camera.cx"),
    (set_to("camera.cy", 1e300), codec.BAD_CAMERA, "camera.cy"),
    (set_to("camera.width", 0), codec.BAD_CAMERA, "camera.width"),
    (set_to("camera.height", 70_000), codec.BAD_CAMERA, "camera.height"),
    (set_to("camera.distortion.model", "fisheye"), codec.BAD_CAMERA, "camera.distortion.model"),
    (set_to("camera.distortion.model", "plumb_bob"), codec.BAD_CAMERA, "camera.distortion"),
    (set_to("camera.distortion.coefficients", [NAN]), codec.BAD_CAMERA, "camera.distortion.coefficients.0"),
    (lambda message: message.ClearField("camera"), codec.BAD_CAMERA, "camera.fx"),
    (lambda message: message.ClearField("world_from_camera"), codec.BAD_POSE, "world_from_camera"),
    (set_to("world_from_camera.position_m", [1, 2]), codec.BAD_POSE, "world_from_camera.position_m"),
    (set_to("world_from_camera.position_m", [1, 2, NAN]), codec.BAD_POSE, "world_from_camera.position_m"),
    (set_to("world_from_camera.position_m", [1e200, 0, 0]), codec.BAD_POSE, "world_from_camera.position_m"),
    (set_to("world_from_camera.orientation_xyzw", []), codec.BAD_POSE, "world_from_camera.orientation_xyzw"),
    (set_to("world_from_camera.orientation_xyzw", [0] * 4), codec.BAD_POSE, "world_from_camera.orientation_xyzw"),
    (set_to("world_from_camera.orientation_xyzw", [0, 0, 0, 2]), codec.BAD_POSE, "world_from_camera.orientation_xyzw"),
    (set_to("world_from_camera.orientation_xyzw", [INF] * 4), codec.BAD_POSE, "world_from_camera.orientation_xyzw"),
    (set_to("covariance", [1.0] * 35), codec.BAD_POSE, "covariance"),
    (set_to("covariance", [INF] * 36), codec.BAD_POSE, "covariance"),
    (lambda message: message.ClearField("features"), codec.NO_CONTENT, "content"),
    (set_to("image", b""), codec.NO_CONTENT, "content"),
    (set_to("features.kind", "surf"), codec.UNKNOWN_DESCRIPTOR, "features.kind"),
    (set_to("features.count", 3), codec.BAD_FEATURES, "features.keypoints"),
    (set_to("features.count", 4_000_000_000), codec.BAD_FEATURES, "features.count"),
    (set_to("features.descriptors", bytes(63)), codec.BAD_FEATURES, "features.descriptors"),
    (set_to("features.kind", "rootsift"), codec.BAD_FEATURES, "features.descriptors"),
    (set_to("features.keypoints", points_at((1, 2), (NAN, 2))), codec.BAD_FEATURES, "features.keypoints"),
    (set_to("features.keypoints", points_at((1, 2), (-0.6, 2))), codec.BAD_FEATURES, "features.keypoints"),
    (set_to("features.keypoints", points_at((1, 2), (5, 79.6))), codec.BAD_FEATURES, "features.keypoints"),
    (set_to("features.thumbnail", bytes(70_000)), codec.BAD_IMAGE, "features.thumbnail"),
]


@pytest.mark.parametrize(("change", "code", "field"), WRONG)
def test_each_wrong_field_is_named(change: object, code: str, field: str) -> None:
    assert callable(change)
    message = good_keyframe()
    codec.decode_keyframe(message.SerializeToString(), robot="r1")
    change(message)
    with pytest.raises(DecodeError) as caught:
        codec.decode_keyframe(message.SerializeToString(), robot="r1")
    assert (caught.value.code, caught.value.field) == (code, field)
    assert caught.value.reason
    assert len(str(caught.value)) < 400


def test_poses_are_judged_as_keyframes_are() -> None:
    message = pb.Pose(robot="r1", boot="b", world_from_camera=good_transform())
    assert codec.decode_pose(message.SerializeToString()).pose.position_m == (1, 2, 3)
    message.world_from_camera.orientation_xyzw[3] = 0.9
    with pytest.raises(DecodeError) as caught:
        codec.decode_pose(message.SerializeToString())
    assert (caught.value.code, caught.value.field) == (codec.BAD_POSE, "world_from_camera.orientation_xyzw")
    with pytest.raises(DecodeError) as caught:
        codec.peek_pose(message.SerializeToString(), robot="r2")
    assert caught.value.code == codec.WRONG_ID


def test_a_quaternion_within_tolerance_comes_out_unit() -> None:
    message = pb.Pose(robot="r1", boot="b", world_from_camera=good_transform())
    message.world_from_camera.orientation_xyzw[3] = 1.0005
    assert codec.decode_pose(message.SerializeToString()).pose.orientation_xyzw == (0, 0, 0, 1)
