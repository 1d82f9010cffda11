"""Writes the corpus: what robots rightly say, in all its forms, for a fuzzer to start from.

python -m tests.fuzz.seeds
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from covista_schemas import codec
from covista_schemas import robot_pb2 as pb
from covista_schemas.messages import Camera, Distortion, Features, Keyframe, Pose, PoseUpdate

from tests.fuzz.ingest_law import ROBOTS, script_of

CORPUS = Path(__file__).parent / "corpus"
_CAMERA = Camera(fx=30, fy=30, cx=15.5, cy=11.5, width=32, height=24)
_POSE = Pose((1.0, 2.0, 3.0), (0.5, 0.5, 0.5, 0.5), time_ns=1_700_000_000 * 10**9)
_COVARIANCE = tuple(np.diag([0.01] * 6).ravel().tolist())
# Heads of records: on a keyframe's key, on a pose's, tokens that come and go, any key; and the loop comes after it.
_KEYFRAME, _POSE_KEY, _TOKEN, _TOKEN_LOST, _ANY, _TURN = 1, 0, 5, 6, 7, 0x80


def payloads() -> Iterator[tuple[str, bytes]]:
    """Names and bytes of messages."""
    yield "pose", codec.encode_pose(PoseUpdate("r1", "b0", 1, _POSE))
    yield "pose_covariance", codec.encode_pose(PoseUpdate("r1", "b0", 2, replace(_POSE, covariance=_COVARIANCE)))
    yield "pose_body", _mounted(pb.Pose(robot="r1", boot="b1", sequence=3))
    yield "keyframe_body", _mounted(pb.Keyframe.FromString(codec.encode_keyframe(_keyframe(image=_picture(".jpg")))))
    for extension in (".jpg", ".png", ".webp"):
        yield f"image_{extension[1:]}", codec.encode_keyframe(_keyframe(image=_picture(extension)))
    for kind, width in (("rootsift", 128), ("orb", 32)):
        features = _features(kind, width)
        yield f"features_{kind}", codec.encode_keyframe(_keyframe(features=features))
        thumbnail = _picture(".jpg")
        yield f"thumbnail_{kind}", codec.encode_keyframe(_keyframe(features=features, thumbnail=thumbnail))
    for model, count in (("plumb_bob", 5), ("equidistant", 4)):
        lens = Distortion(model=model, coefficients=(0.1,) * count)
        camera = _CAMERA.model_copy(update={"distortion": lens})
        yield f"lens_{model}", codec.encode_keyframe(replace(_keyframe(features=_features("orb", 32)), camera=camera))
    yield "later_version", codec.encode_pose(PoseUpdate("r1", "b0", 4, _POSE)) + b"\xfa\x3e\x03abc"


def scripts() -> Iterator[tuple[str, bytes]]:
    """Names and bytes of scripts: each message alone, and some lives of robots."""
    said = dict(payloads())
    for name, data in said.items():
        head = _POSE_KEY if name.startswith("pose") or name == "later_version" else _KEYFRAME
        yield name, script_of([(head, data)])
    pose, features, image = said["pose"], said["features_orb"], said["image_jpg"]
    yield (
        "life",
        script_of(
            [
                (_TOKEN, b"b0"),
                (_KEYFRAME | _TURN, features),
                (_POSE_KEY, pose),
                (_POSE_KEY | _TURN, pose),
                (_TOKEN_LOST, b"b0"),
            ]
        ),
    )
    yield "pictures", script_of([(_KEYFRAME | _TURN, image)] * 2 + [(_KEYFRAME, features)])
    yield "rivals", script_of([(_KEYFRAME | 8, features), (_POSE_KEY | 8, pose), (_POSE_KEY | _TURN, b"\xff\xff")])
    # More robots than there is room for, and ends of tokens of more than may take their leave.
    yield "crowd", script_of([*_poses("r1", "r2"), *((_TOKEN_LOST | at, b"b0") for at in (16, 48, 56)), *_poses("r4")])
    key = b"covista/default/robots/r2/pose"
    yield "keys", script_of([(_ANY, key), (_ANY, key + b"/x"), (_POSE_KEY | 24, pose), (_KEYFRAME | 32, features)])


def _poses(*robots: str) -> Iterator[tuple[int, bytes]]:
    """One of each, on its own key."""
    for robot in robots:
        yield _POSE_KEY | ROBOTS.index(robot) << 3, codec.encode_pose(PoseUpdate(robot, "b0", 0, _POSE))


def _keyframe(**content: object) -> Keyframe:
    return Keyframe("r1", "b0", 0, _CAMERA, _POSE, **content)


def _features(kind: str, width: int) -> Features:
    rng = np.random.default_rng(0)
    return Features.from_arrays(kind, rng.uniform(0, 23, (3, 2)), rng.integers(0, 256, (3, width), np.uint8))


def _picture(extension: str) -> bytes:
    """A small grey picture."""
    ramp = np.add.outer(np.arange(24, dtype=np.uint8), np.arange(32, dtype=np.uint8))
    return bytes(cv2.imencode(extension, ramp)[1])


def _mounted(message: pb.Pose | pb.Keyframe) -> bytes:
    """The pose given of a body that the camera stands on."""
    message.ClearField("world_from_camera")
    message.world_from_body.position_m.extend(_POSE.position_m)
    message.world_from_body.orientation_xyzw.extend(_POSE.orientation_xyzw)
    message.body_from_camera.position_m.extend((0.1, 0.0, 0.2))
    message.body_from_camera.orientation_xyzw.extend((0.0, 0.0, 0.0, 1.0))
    return message.SerializeToString()


def main() -> None:
    """Write both corpora."""
    for target, seeds in (("codec", payloads()), ("ingest", scripts())):
        folder = CORPUS / target
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in seeds:
            (folder / name).write_bytes(data)


if __name__ == "__main__":
    main()
