from __future__ import annotations

import socket
import threading
from collections.abc import Iterator

import cv2
import numpy as np
import pytest
import zenoh
from covista_clients.simulation.swarm import KeyframeRecord, SwarmOptions, run_swarm
from covista_schemas import codec, keys
from covista_schemas.messages import Keyframe, Pose, PoseUpdate
from covista_schemas.zenoh_config import config

DEADLINE_S = 20.0


class Station:
    """A router that keeps what it hears."""

    def __init__(self, endpoint: str) -> None:
        self.keyframes: list[Keyframe] = []
        self.poses: list[PoseUpdate] = []
        self.heard = threading.Condition()
        self.session = zenoh.open(config("router", listen=[endpoint]))
        for topic, take in ((keys.RobotTopic.KEYFRAME, self._keyframe), (keys.RobotTopic.POSE, self._pose)):
            self.session.declare_subscriber(keys.every("default", topic), take)

    def _keyframe(self, sample: zenoh.Sample) -> None:
        with self.heard:
            self.keyframes.append(codec.decode_keyframe(sample.payload.to_bytes()))
            self.heard.notify_all()

    def _pose(self, sample: zenoh.Sample) -> None:
        with self.heard:
            self.poses.append(codec.decode_pose(sample.payload.to_bytes()))
            self.heard.notify_all()


@pytest.fixture
def endpoint() -> str:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{free.getsockname()[1]}"


@pytest.fixture
def station(endpoint: str) -> Iterator[Station]:
    listening = Station(endpoint)
    try:
        yield listening
    finally:
        listening.session.close()


def test_a_swarm_sends_what_its_cameras_see(station: Station, endpoint: str) -> None:
    options = SwarmOptions(robots=2, world="wall", rate_hz=10, pose_rate_hz=20, connect=endpoint)
    records: list[KeyframeRecord] = []
    stop, leave, enough = threading.Event(), threading.Event(), threading.Event()

    def note(record: KeyframeRecord) -> None:
        records.append(record)
        if len(records) >= 12:
            enough.set()

    swarm = threading.Thread(target=run_swarm, args=(options, stop, note, None, leave))
    swarm.start()
    try:
        assert enough.wait(DEADLINE_S)
        stop.set()
        with station.heard:
            assert station.heard.wait_for(lambda: len(station.keyframes) >= len(_named(records)), DEADLINE_S)
        assert swarm.is_alive()
    finally:
        stop.set()
        leave.set()
        swarm.join(DEADLINE_S)
    assert not swarm.is_alive()
    assert {keyframe.robot for keyframe in station.keyframes} == {"r1", "r2"}
    assert {pose.robot for pose in station.poses} == {"r1", "r2"}
    for keyframe in station.keyframes:
        pose = _named(records)[keyframe.robot, keyframe.boot, keyframe.sequence]
        assert (keyframe.pose.position_m, keyframe.pose.time_ns) == (pose.position_m, pose.time_ns)
        assert keyframe.pose.orientation_xyzw == pytest.approx(pose.orientation_xyzw)
        assert keyframe.image is not None
        assert cv2.imdecode(np.frombuffer(keyframe.image, np.uint8), cv2.IMREAD_COLOR).shape == (240, 320, 3)


def _named(records: list[KeyframeRecord]) -> dict[tuple[str, str, int], Pose]:
    """Of records with one name the last one holds."""
    return {(record.robot, record.boot, record.sequence): record.pose for record in records}


def test_a_swarm_without_a_station_ends_when_told(endpoint: str) -> None:
    stop = threading.Event()
    options = SwarmOptions(robots=1, world="wall", rate_hz=20, connect=endpoint)
    progress = run_swarm(options, stop, on_keyframe=lambda _: stop.set())
    assert progress.keyframes == 1


def test_a_large_swarm_without_a_station_ends_when_told(endpoint: str) -> None:
    stop = threading.Event()
    stop.set()
    assert run_swarm(SwarmOptions(robots=20, world="wall", connect=endpoint), stop).keyframes == 0
