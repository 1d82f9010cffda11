"""Between bytes on the wire and messages; one error type, `DecodeError`, says which field is wrong and why.

Its codes are a closed list (`CODES`), so that they can be counted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar, cast

import numpy as np
from google.protobuf.message import DecodeError as ProtobufDecodeError
from google.protobuf.message import Message
from numpy.typing import NDArray
from pydantic import ValidationError

from covista_schemas import keys
from covista_schemas import robot_pb2 as pb
from covista_schemas.errors import DecodeError, KeyExpressionError
from covista_schemas.messages import (
    DESCRIPTOR_BYTES,
    MAX_FEATURES,
    MAX_THUMBNAIL_BYTES,
    UNIT_TOLERANCE,
    Camera,
    Distortion,
    FeatureKind,
    Features,
    Keyframe,
    Pose,
    PoseUpdate,
    check_inside,
    numbers,
)

KEYFRAME_ENCODING = "application/protobuf;covista.v1.Keyframe"
POSE_ENCODING = "application/protobuf;covista.v1.Pose"

MALFORMED = "malformed"
WRONG_ID = "wrong_id"
BAD_CAMERA = "bad_camera"
BAD_POSE = "bad_pose"
BAD_FEATURES = "bad_features"
UNKNOWN_DESCRIPTOR = "unknown_descriptor"
NO_CONTENT = "no_content"
BAD_IMAGE = "bad_image"
IMAGE_TOO_LARGE = "image_too_large"
TOO_LARGE = "too_large"
CODES = (
    MALFORMED,
    WRONG_ID,
    BAD_CAMERA,
    BAD_POSE,
    BAD_FEATURES,
    UNKNOWN_DESCRIPTOR,
    NO_CONTENT,
    BAD_IMAGE,
    IMAGE_TOO_LARGE,
    TOO_LARGE,
)
# A pose with its covariance has some 400 bytes; the rest is for fields that are not known yet.
MAX_POSE_BYTES = 16 * 1024
# As much as zenoh hands over in one piece.
MAX_KEYFRAME_BYTES = 4 * 1024 * 1024
# The wire has room for twice as many, but databases do not.
MAX_SEQUENCE = 2**63 - 1

_M = TypeVar("_M", bound=Message)
_Vector = tuple[float, float, float]
_Quaternion = tuple[float, float, float, float]
_NO_MOTION: tuple[_Vector, _Quaternion] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def encode_keyframe(keyframe: Keyframe) -> bytes:
    """Bytes of a keyframe, `covista.v1.Keyframe`."""
    message = _taken(PoseUpdate(keyframe.robot, keyframe.boot, keyframe.sequence, keyframe.pose))
    message.camera.CopyFrom(_encode_camera(keyframe.camera))
    if keyframe.image is not None:
        message.image = keyframe.image
    elif keyframe.features is not None:
        message.features.CopyFrom(_encode_features(keyframe.features, keyframe.thumbnail))
    return message.SerializeToString()


def encode_picture(camera: Camera, features: Features, thumbnail: bytes | None = None) -> bytes:
    """What stays the same of keyframes that show the same, for `encode_taken`."""
    return pb.Keyframe(
        camera=_encode_camera(camera), features=_encode_features(features, thumbnail)
    ).SerializeToString()


def encode_taken(update: PoseUpdate, picture: bytes) -> bytes:
    """Bytes of a keyframe with its name and pose from `update`, and a picture that `encode_picture` has encoded.

    Fields of a message may stand in any order, so that the two parts in a row are the message.
    """
    return _taken(update).SerializeToString() + picture


def encode_pose(update: PoseUpdate) -> bytes:
    """Bytes of a pose, `covista.v1.Pose`."""
    return pb.Pose(
        robot=update.robot,
        boot=update.boot,
        sequence=update.sequence,
        time_ns=update.pose.time_ns,
        world_from_camera=_encode_transform(update.pose),
        covariance=update.pose.covariance,
    ).SerializeToString()


def decode_keyframe(data: bytes, *, robot: str | None = None) -> Keyframe:
    """The keyframe in `data`; with `robot`, the id inside must be that of the key. Raises DecodeError."""
    check_size(len(data), MAX_KEYFRAME_BYTES)
    message = _parse(pb.Keyframe(), data)
    _check_name(message, robot)
    camera = _decode_camera(message.camera)
    pose = _decode_pose(message, tuple(message.covariance))
    image: bytes | None = None
    features: Features | None = None
    thumbnail: bytes | None = None
    match message.WhichOneof("content"):
        case "image" if message.image:
            image = message.image
        case "features":
            features = _decode_features(message.features, camera)
            thumbnail = _checked_thumbnail(message.features.thumbnail)
        case _:
            raise DecodeError(NO_CONTENT, "content", "neither an image nor features")
    return Keyframe(message.robot, message.boot, message.sequence, camera, pose, image, features, thumbnail)


def decode_pose(data: bytes, *, robot: str | None = None) -> PoseUpdate:
    """The pose in `data`; with `robot`, the id inside must be that of the key. Raises DecodeError."""
    check_size(len(data), MAX_POSE_BYTES)
    message = _parse(pb.Pose(), data)
    _check_name(message, robot)
    pose = _decode_pose(message, tuple(message.covariance))
    return PoseUpdate(message.robot, message.boot, message.sequence, pose)


def peek_keyframe(data: bytes, *, robot: str | None = None) -> tuple[str, str, int]:
    """Only (robot, boot, sequence) of the keyframe in `data`, checked as `decode_keyframe` does. Raises DecodeError."""
    check_size(len(data), MAX_KEYFRAME_BYTES)
    return _peek(pb.Keyframe(), data, robot)


def peek_pose(data: bytes, *, robot: str | None = None) -> tuple[str, str, int]:
    """Only (robot, boot, sequence) of the pose in `data`, checked as `decode_pose` does. Raises DecodeError."""
    check_size(len(data), MAX_POSE_BYTES)
    return _peek(pb.Pose(), data, robot)


def check_size(size: int, most: int) -> None:
    """Raise DecodeError if a message has more bytes than one of its kind may have."""
    if size > most:
        raise DecodeError(TOO_LARGE, "payload", f"{size} bytes, more than the {most} that it may have")


def _peek(message: pb.Keyframe | pb.Pose, data: bytes, robot: str | None) -> tuple[str, str, int]:
    _parse(message, data)
    _check_name(message, robot)
    return message.robot, message.boot, message.sequence


def _parse(message: _M, data: bytes) -> _M:
    try:
        message.ParseFromString(data)
    except ProtobufDecodeError as error:
        name = message.DESCRIPTOR.full_name
        raise DecodeError(MALFORMED, "payload", f"{len(data)} bytes that are not a {name}") from error
    return message


def _check_name(message: pb.Keyframe | pb.Pose, expected: str | None) -> None:
    for field, value in (("robot", message.robot), ("boot", message.boot)):
        try:
            keys.check_id(value, field)
        except KeyExpressionError as error:
            raise DecodeError(WRONG_ID, field, str(error)) from error
    if expected is not None and message.robot != expected:
        raise DecodeError(WRONG_ID, "robot", f"{message.robot!r} inside, but {expected!r} in the key")
    if message.sequence > MAX_SEQUENCE:
        raise DecodeError(MALFORMED, "sequence", f"{message.sequence}, more than {MAX_SEQUENCE}")


def _taken(update: PoseUpdate) -> pb.Keyframe:
    """A keyframe's name and pose."""
    return pb.Keyframe(
        robot=update.robot,
        boot=update.boot,
        sequence=update.sequence,
        time_ns=update.pose.time_ns,
        world_from_camera=_encode_transform(update.pose),
        covariance=update.pose.covariance,
    )


def _encode_camera(camera: Camera) -> pb.Camera:
    message = pb.Camera(**camera.model_dump(exclude={"distortion"}))
    if camera.distortion.model != "none":
        message.distortion.model = camera.distortion.model
        message.distortion.coefficients.extend(camera.distortion.coefficients)
    return message


def _decode_camera(message: pb.Camera) -> Camera:
    try:
        return Camera(
            fx=message.fx,
            fy=message.fy,
            cx=message.cx,
            cy=message.cy,
            width=message.width,
            height=message.height,
            distortion=Distortion.model_validate(
                {
                    "model": message.distortion.model or "none",
                    "coefficients": tuple(message.distortion.coefficients),
                }
            ),
        )
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in (*_prefix(error), *first["loc"]))
        raise DecodeError(
            BAD_CAMERA, f"camera.{where}".rstrip("."), f"{first['msg']}, got {first['input']!r}"[:300]
        ) from error


def _prefix(error: ValidationError) -> tuple[str, ...]:
    return ("distortion",) if error.title == "Distortion" else ()


def _encode_transform(pose: Pose) -> pb.Transform:
    return pb.Transform(position_m=pose.position_m, orientation_xyzw=pose.orientation_xyzw)


def _decode_pose(message: pb.Keyframe | pb.Pose, covariance: tuple[float, ...]) -> Pose:
    if message.HasField("world_from_camera"):
        field = "world_from_camera"
        position, orientation = _decode_transform(message.world_from_camera, field)
    elif message.HasField("world_from_body"):
        field = "world_from_body"
        outer = _decode_transform(message.world_from_body, field)
        has_mount = message.HasField("body_from_camera")
        inner = _decode_transform(message.body_from_camera, "body_from_camera") if has_mount else _NO_MOTION
        position, orientation = _compose(outer, inner)
    else:
        raise DecodeError(BAD_POSE, "world_from_camera", "no pose given")
    try:
        return Pose(position, orientation, message.time_ns, covariance)
    except ValueError as error:
        name, _, reason = str(error).partition(": ")
        raise DecodeError(BAD_POSE, name if name == "covariance" else f"{field}.{name}", reason) from error


def _decode_transform(message: pb.Transform, field: str) -> tuple[_Vector, _Quaternion]:
    position = _numbers(message.position_m, 3, f"{field}.position_m")
    orientation = _numbers(message.orientation_xyzw, 4, f"{field}.orientation_xyzw")
    norm = math.hypot(*orientation)
    if abs(norm - 1.0) > UNIT_TOLERANCE:
        raise DecodeError(BAD_POSE, f"{field}.orientation_xyzw", f"length {norm:.4g}, not 1")
    unit = tuple(value / norm for value in orientation)
    return cast(_Vector, position), cast(_Quaternion, unit)


def _numbers(values: Sequence[float], count: int, field: str) -> tuple[float, ...]:
    try:
        return numbers(field, values, count)
    except ValueError as error:
        raise DecodeError(BAD_POSE, field, str(error).partition(": ")[2]) from error


def _compose(
    world_from_body: tuple[_Vector, _Quaternion], body_from_camera: tuple[_Vector, _Quaternion]
) -> tuple[_Vector, _Quaternion]:
    """world_from_camera: p = p_wb + R_wb p_bc, and the product of the quaternions.

    In plain numbers: for vectors of three, arrays cost ten times as much.
    """
    (p, (x, y, z, w)), (lever, (a, b, c, d)) = world_from_body, body_from_camera
    # R v = v + 2 w (q x v) + 2 q x (q x v)
    u = _cross((x, y, z), lever)
    v = _cross((x, y, z), u)
    position = tuple(p[i] + lever[i] + 2.0 * (w * u[i] + v[i]) for i in range(3))
    orientation = (
        w * a + d * x + y * c - z * b,
        w * b + d * y + z * a - x * c,
        w * c + d * z + x * b - y * a,
        w * d - x * a - y * b - z * c,
    )
    return cast(_Vector, position), orientation


def _cross(a: _Vector, b: _Vector) -> _Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _encode_features(features: Features, thumbnail: bytes | None) -> pb.Features:
    return pb.Features(
        kind=features.kind.value,
        count=len(features),
        keypoints=np.ascontiguousarray(features.keypoints_px, "<f4").tobytes(),
        descriptors=features.descriptors.tobytes(),
        thumbnail=thumbnail or b"",
    )


def _decode_features(message: pb.Features, camera: Camera) -> Features:
    try:
        kind = FeatureKind(message.kind)
    except ValueError as error:
        known = ", ".join(FeatureKind)
        raise DecodeError(UNKNOWN_DESCRIPTOR, "features.kind", f"{message.kind[:40]!r}, not one of {known}") from error
    n = message.count
    if n > MAX_FEATURES:
        raise DecodeError(BAD_FEATURES, "features.count", f"{n} features, more than {MAX_FEATURES}")
    if len(message.keypoints) != 8 * n:
        raise DecodeError(
            BAD_FEATURES, "features.keypoints", f"{len(message.keypoints)} bytes for {n} points, not {8 * n}"
        )
    points = np.frombuffer(message.keypoints, "<f4").reshape(n, 2)
    try:
        features = Features.from_arrays(kind, points, _descriptors(kind, n, message.descriptors))
        check_inside(features.keypoints_px, camera)
    except DecodeError:
        raise
    except ValueError as error:
        name, _, reason = str(error).partition(": ")
        raise DecodeError(BAD_FEATURES, f"features.{name}", reason) from error
    return features


def _checked_thumbnail(data: bytes) -> bytes | None:
    if len(data) > MAX_THUMBNAIL_BYTES:
        raise DecodeError(BAD_IMAGE, "features.thumbnail", f"{len(data)} bytes, more than {MAX_THUMBNAIL_BYTES}")
    return data or None


def _descriptors(kind: FeatureKind, n: int, data: bytes) -> NDArray[np.generic]:
    width = DESCRIPTOR_BYTES[kind]
    if len(data) == n * width:
        return np.frombuffer(data, np.uint8).reshape(n, width)
    if kind is FeatureKind.ROOTSIFT and len(data) == 4 * n * width:
        return np.frombuffer(data, "<f4").reshape(n, width)
    raise DecodeError(
        BAD_FEATURES, "features.descriptors", f"{len(data)} bytes for {n} {kind} descriptors of {width} bytes"
    )
