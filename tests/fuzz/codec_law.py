"""Whatever bytes come: the codec gives a message that can be written again, or one error from its list."""

import numpy as np
from covista_schemas import codec
from covista_schemas import robot_pb2 as pb
from covista_schemas.errors import DecodeError
from covista_schemas.messages import MAX_FEATURES, Features, Keyframe, Pose, PoseUpdate, check_inside
from covista_schemas.names import NameReader

MOST_TEXT = 500
Name = tuple[str, str, int]
# They live through all payloads, as a station's do.
_READERS = {"keyframe": NameReader(pb.Keyframe), "pose": NameReader(pb.Pose)}


def check_payload(data: bytes, robot: str = "r1") -> None:
    """Raise AssertionError, or whatever came instead of a DecodeError."""
    keyframe = _decoded("keyframe", data, robot)
    if isinstance(keyframe, Keyframe):
        check_keyframe(keyframe)
    pose = _decoded("pose", data, robot)
    if isinstance(pose, PoseUpdate):
        check_pose(pose.pose)
        again = codec.decode_pose(codec.encode_pose(pose))
        assert _name(again) == _name(pose)
        check_same_pose(pose.pose, again.pose)


def _decoded(topic: str, data: bytes, robot: str) -> Keyframe | PoseUpdate | DecodeError:
    """What decoding says, once peeking and the reader of names have been found to say the same of the name."""
    pose = topic == "pose"
    peeked = _tried(codec.peek_pose if pose else codec.peek_keyframe, data, robot)
    found = _tried(codec.decode_pose if pose else codec.decode_keyframe, data, robot)
    read, complaint = _READERS[topic].read(data, robot), _READERS[topic].complain(data, robot)
    if isinstance(peeked, DecodeError):
        assert isinstance(found, DecodeError)
        assert (found.code, str(found)) == (peeked.code, str(peeked))
        assert (read, complaint) == (peeked.code, str(peeked))
    else:
        assert peeked[0] == robot
        assert (read, complaint) == (peeked[1:], "")
        assert isinstance(found, DecodeError) or _name(found) == peeked
    return found


def _tried(read, data: bytes, robot: str):
    try:
        return read(data, robot=robot)
    except DecodeError as error:
        check_error(error)
        return error


def check_error(error: DecodeError) -> None:
    """It is one of those that are counted, and fits into one line for a person."""
    assert error.code in codec.CODES
    assert error.field
    check_text(str(error))


def check_text(text: str) -> None:
    assert text
    assert len(text) <= MOST_TEXT, text
    assert text.isprintable(), repr(text)


def check_keyframe(keyframe: Keyframe) -> None:
    check_pose(keyframe.pose)
    again = codec.decode_keyframe(codec.encode_keyframe(keyframe))
    assert _name(again) == _name(keyframe)
    assert (again.camera, again.image, again.thumbnail) == (keyframe.camera, keyframe.image, keyframe.thumbnail)
    check_same_pose(keyframe.pose, again.pose)
    if keyframe.features is None:
        assert keyframe.image
        assert again.features is None
        return
    assert again.features is not None
    assert again.features.kind is keyframe.features.kind
    check_inside(keyframe.features.keypoints_px, keyframe.camera)
    check_same_features(keyframe.features, again.features)


def check_same_features(one: Features, other: Features) -> None:
    assert len(one) == len(one.descriptors) <= MAX_FEATURES
    np.testing.assert_array_equal(one.keypoints_px, other.keypoints_px)
    np.testing.assert_array_equal(one.descriptors, other.descriptors)


def check_pose(pose: Pose) -> None:
    """No number travels on that is not finite."""
    assert np.isfinite([*pose.position_m, *pose.orientation_xyzw, *pose.covariance]).all()
    assert abs(np.linalg.norm(pose.orientation_xyzw) - 1) < 1e-9
    assert len(pose.covariance) in (0, 36)


def check_same_pose(one: Pose, other: Pose) -> None:
    assert (one.position_m, one.time_ns, one.covariance) == (other.position_m, other.time_ns, other.covariance)
    np.testing.assert_allclose(one.orientation_xyzw, other.orientation_xyzw, atol=1e-12)


def _name(message: Keyframe | PoseUpdate) -> Name:
    return message.robot, message.boot, message.sequence
