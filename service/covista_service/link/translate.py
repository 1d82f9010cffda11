"""Between the wire and the station: the only place where a message becomes an event. Runs when the loop asks."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import numpy as np
from covista_schemas import codec, messages
from covista_schemas.errors import DecodeError

from covista_service.link.mailbox import OVERFLOW, TOO_FAST, Box, Letter, Mail
from covista_service.link.pictures import check_image, check_thumbnail
from covista_service.perception.camera import Camera, Features, Pose, rotation_of
from covista_service.perception.extent import UNTOLD, Doubt
from covista_service.station.events import (
    Event,
    Keyframe,
    KeyframeArrived,
    KeyframeId,
    MessageDropped,
    MessagesReceived,
    PoseArrived,
    TokenLost,
    TokenSeen,
    Topic,
)
from covista_service.telemetry import about

FAULT = "station_fault"

log = logging.getLogger(__name__)


def events_of(mail: Mail) -> Iterator[Event]:
    """What a robot's mail means, in the order in which the station should hear it."""
    if mail.tokens_lost:
        yield TokenLost(mail.robot, None)
    for boot, alive in mail.tokens.items():
        yield TokenSeen(mail.robot, boot) if alive else TokenLost(mail.robot, boot)
    for topic, box in mail.garbage.items():
        yield from _accounts(mail.robot, topic, box)
    # A pose that came before the keyframe would be old news after it.
    for topic, box in sorted(mail.boxes.items(), key=lambda each: each[1].kept.arrived_ns if each[1].kept else 0):
        yield from _accounts(mail.robot, topic, box)
        if box.kept is not None:
            yield _open(box.kept)


def camera_of(camera: messages.Camera) -> Camera:
    """The camera as the maths sees it."""
    matrix = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
    distortion = camera.distortion
    return Camera(matrix, camera.width, camera.height, distortion.model, distortion.coefficients)


def pose_of(pose: messages.Pose) -> Pose:
    """The pose as the maths sees it."""
    return Pose(rotation_of(pose.orientation_xyzw), np.array(pose.position_m, np.float64))


def doubt_of(pose: messages.Pose) -> Doubt:
    """How far the pose may be off, by its covariance if there is one."""
    return Doubt.of(np.array(pose.covariance).reshape(6, 6)) if pose.covariance else UNTOLD


def features_of(features: messages.Features) -> Features:
    """The features as the maths sees them."""
    return Features(features.kind.value, features.keypoints_px, features.descriptors)


def _accounts(robot: str, topic: Topic, box: Box) -> Iterator[Event]:
    if box.names:
        kept = box.kept.name if box.kept is not None else None
        yield MessagesReceived(robot, topic, tuple(box.names), kept, box.arrived_ns)
    for code, refusal in box.refusals.items():
        yield MessageDropped(robot, topic, code, refusal.text, box.arrived_ns, counted=False, count=refusal.count)
    if box.surplus:
        count, runs = box.surplus.count, box.surplus.runs()
        yield MessageDropped(robot, topic, OVERFLOW, TOO_FAST, box.arrived_ns, counted=False, count=count, runs=runs)


def _open(letter: Letter) -> Event:
    try:
        return _keyframe(letter) if letter.topic == "keyframe" else _pose(letter)
    except DecodeError as error:
        return _drop(letter, error.code, str(error))
    except Exception:
        # A bug that one message brings to light costs that message, and stands in its robot's account.
        fields = about(robot=letter.robot, topic=letter.topic, boot=letter.boot, sequence=letter.sequence)
        log.exception("cannot open a message", extra=fields)
        return _drop(letter, FAULT, "the station failed to read it")


def _drop(letter: Letter, code: str, text: str) -> MessageDropped:
    return MessageDropped(letter.robot, letter.topic, code, text, letter.arrived_ns, counted=True)


def _keyframe(letter: Letter) -> KeyframeArrived:
    wire = codec.decode_keyframe(letter.data, robot=letter.robot)
    if wire.image is not None:
        check_image(wire.image, wire.camera.width, wire.camera.height)
    if wire.thumbnail is not None:
        check_thumbnail(wire.thumbnail)
    return KeyframeArrived(
        Keyframe(
            KeyframeId(wire.robot, wire.boot, wire.sequence),
            wire.pose.time_ns,
            letter.arrived_ns,
            camera_of(wire.camera),
            pose_of(wire.pose),
            wire.image,
            None if wire.features is None else features_of(wire.features),
            wire.thumbnail,
            doubt_of(wire.pose),
        )
    )


def _pose(letter: Letter) -> PoseArrived:
    wire = codec.decode_pose(letter.data, robot=letter.robot)
    return PoseArrived(wire.robot, wire.boot, wire.sequence, wire.pose.time_ns, letter.arrived_ns, pose_of(wire.pose))
