import numpy as np
import pytest
from covista_schemas import codec, features
from covista_schemas.messages import Camera, Distortion, Keyframe, Pose
from covista_service.link.mailbox import Letter, Mailboxes
from covista_service.link.translate import FAULT, camera_of, doubt_of, events_of, pose_of
from covista_service.perception.extent import UNTOLD
from covista_service.station.events import (
    Event,
    KeyframeArrived,
    MessageDropped,
    MessagesReceived,
    PoseArrived,
    TokenLost,
    TokenSeen,
    Topic,
)

from tests.service.wall import CAMERA, keyframe_bytes, picture, picture_bytes, pose_bytes, seen_from


def opened(data: bytes, topic: Topic = "keyframe", robot: str = "r1") -> list[Event]:
    boxes = Mailboxes()
    boxes.put(Letter(robot, topic, "b0", 0, data, 77))
    return [event for mail in boxes.drain(1, 10**9)[0] for event in events_of(mail)]


def test_a_keyframe_comes_through_whole() -> None:
    received, arrived = opened(keyframe_bytes("r1", 0.5, time_ns=5))
    assert received == MessagesReceived("r1", "keyframe", (("b0", 0),), ("b0", 0), 77)
    assert isinstance(arrived, KeyframeArrived)
    keyframe = arrived.keyframe
    assert (keyframe.id.robot, keyframe.id.boot, keyframe.id.sequence) == ("r1", "b0", 0)
    assert (keyframe.time_ns, keyframe.arrived_ns) == (5, 77)
    assert keyframe.camera.matrix.tolist() == [[300, 0, 159.5], [0, 300, 119.5], [0, 0, 1]]
    assert keyframe.pose.centre_m.tolist() == [0.5, 0, 0]
    assert keyframe.features is not None
    np.testing.assert_array_equal(keyframe.features.keypoints_px, seen_from(0.5).keypoints_px)
    np.testing.assert_array_equal(keyframe.features.descriptors, seen_from(0.5).descriptors)


def test_a_picture_stays_encoded() -> None:
    _, arrived = opened(picture_bytes("r1"))
    assert isinstance(arrived, KeyframeArrived)
    assert arrived.keyframe.image == features.encode_jpeg(picture())
    assert arrived.keyframe.features is None


def test_a_pose_comes_through_whole() -> None:
    received, arrived = opened(pose_bytes("r1", 2.0, time_ns=9), "pose")
    assert received == MessagesReceived("r1", "pose", (("b0", 0),), ("b0", 0), 77)
    assert isinstance(arrived, PoseArrived)
    assert (arrived.robot, arrived.boot, arrived.sequence, arrived.time_ns) == ("r1", "b0", 0, 9)
    assert arrived.pose.centre_m.tolist() == [2, 0, 0]


def test_orientations_are_world_from_camera() -> None:
    quarter = np.sqrt(0.5)
    pose = pose_of(Pose((1, 2, 3), (0, 0, quarter, quarter)))
    np.testing.assert_allclose(pose.world_from_camera @ [1, 0, 0], [0, 1, 0], atol=1e-12)


def test_a_covariance_becomes_a_doubt_about_the_pose() -> None:
    spread = np.diag([0.01, 0.01, 0.04, 1e-4, 1e-6, 1e-6])
    told = doubt_of(Pose((1, 2, 3), covariance=tuple(spread.ravel().tolist())))
    assert (told.distance_m, told.angle_rad, told.depth_share) == pytest.approx((0.4, 0.02, 0.0))
    assert doubt_of(Pose((1, 2, 3))) == UNTOLD


def test_distortion_is_kept() -> None:
    camera = Camera(
        fx=1, fy=2, cx=3, cy=4, width=5, height=6, distortion=Distortion(model="equidistant", coefficients=(1, 2, 3, 4))
    )
    seen = camera_of(camera)
    assert (seen.distortion, seen.coefficients) == ("equidistant", (1, 2, 3, 4))


@pytest.mark.parametrize(
    ("data", "topic", "code"),
    [
        (keyframe_bytes("r2"), "keyframe", codec.WRONG_ID),
        (b"\xff\xff", "keyframe", codec.MALFORMED),
        (picture_bytes("r1", b"not a picture"), "keyframe", codec.BAD_IMAGE),
        (picture_bytes("r1", features.encode_jpeg(picture())[:-300]), "keyframe", codec.BAD_IMAGE),
        (picture_bytes("r1", features.encode_jpeg(picture()[:100])), "keyframe", codec.BAD_IMAGE),
        (pose_bytes("r2"), "pose", codec.WRONG_ID),
    ],
)
def test_what_cannot_be_used_is_dropped_after_it_was_counted(data: bytes, topic: Topic, code: str) -> None:
    received, dropped = opened(data, topic)
    assert isinstance(received, MessagesReceived)
    assert isinstance(dropped, MessageDropped)
    assert (dropped.robot, dropped.topic, dropped.code, dropped.counted, dropped.count) == ("r1", topic, code, True, 1)


def test_a_broken_thumbnail_spoils_its_keyframe() -> None:
    data = codec.encode_keyframe(
        Keyframe("r1", "b0", 0, CAMERA, Pose((0, 0, 0)), features=seen_from(0), thumbnail=b"no picture")
    )
    _, dropped = opened(data)
    assert isinstance(dropped, MessageDropped)
    assert dropped.text.startswith("features.thumbnail: ")


def test_a_bug_in_reading_costs_one_message_and_is_told(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(data: bytes, *, robot: str | None = None) -> None:
        raise IndexError

    monkeypatch.setattr(codec, "decode_pose", broken)
    _, dropped = opened(pose_bytes("r1"), "pose")
    assert isinstance(dropped, MessageDropped)
    assert (dropped.code, dropped.counted) == (FAULT, True)
    assert "IndexError" in caplog.text


def test_refusals_and_tokens_become_events() -> None:
    boxes = Mailboxes()
    boxes.token("r1", "b0", True, 1)
    boxes.token("r1", "old", False, 1)
    for _ in range(3):
        boxes.refuse("r1", "pose", codec.MALFORMED, lambda: "payload: garbage", 2)
    (mail,), _ = boxes.drain(1, 10**9)
    assert list(events_of(mail)) == [
        TokenSeen("r1", "b0"),
        TokenLost("r1", "old"),
        MessageDropped("r1", "pose", codec.MALFORMED, "payload: garbage", 2, counted=False, count=3),
    ]


def test_what_came_first_is_heard_first() -> None:
    """A pose that came before a keyframe would be outdated by it, and the other way round."""
    boxes = Mailboxes()
    boxes.put(Letter("r1", "pose", "b0", 0, pose_bytes("r1", 0.1), 77))
    boxes.put(Letter("r1", "keyframe", "b0", 0, keyframe_bytes("r1", 0.5), 78))
    boxes.put(Letter("r2", "keyframe", "b0", 0, keyframe_bytes("r2", 0.5), 77))
    boxes.put(Letter("r2", "pose", "b0", 0, pose_bytes("r2", 0.6), 78))
    kinds: dict[str, list[type[Event]]] = {}
    for mail in boxes.drain(2, 10**9)[0]:
        kinds[mail.robot] = [type(event) for event in events_of(mail) if not isinstance(event, MessagesReceived)]
    assert kinds == {"r1": [PoseArrived, KeyframeArrived], "r2": [KeyframeArrived, PoseArrived]}
