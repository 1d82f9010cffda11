import logging
import queue
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import zenoh
from covista_clients import Camera, Features, Pose, Rover
from covista_clients.rover import rover as rover_module
from covista_clients.rover.link import RoverLink
from covista_schemas import codec, keys
from covista_schemas.errors import LinkError
from covista_schemas.reports import KeyframeId, OwnGroupReport, RobotReport
from covista_schemas.zenoh_config import config

from tests.clients.ground import DEADLINE_S, SITE, Ground, report_on

pytestmark = pytest.mark.usefixtures("no_thread_left")
CAMERA = Camera(fx=60, fy=60, cx=31.5, cy=23.5, width=64, height=48)
PICTURE = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)


def at(x: float) -> Pose:
    return Pose((x, 0, 0), time_ns=int(x * 1e9))


def test_keyframes_arrive_in_order_and_confirmed(endpoint: str, ground: Ground) -> None:
    with Rover("r1", CAMERA, endpoint) as rover:
        for number in range(3):
            assert rover.send_keyframe(PICTURE, at(number)) == KeyframeId(boot=rover.boot, sequence=number)
            ground.wait(lambda number=number: len(ground.keyframes) == number + 1)
    assert rover.keyframes_sent == 3
    assert ground.asked > 0
    for number, keyframe in enumerate(ground.keyframes):
        assert (keyframe.robot, keyframe.boot, keyframe.sequence) == ("r1", rover.boot, number)
        assert (keyframe.camera, keyframe.pose) == (CAMERA, at(number))
        assert keyframe.image is not None


def test_keyframes_give_way_to_poses(endpoint: str, ground: Ground) -> None:
    with Rover("r1", CAMERA, endpoint) as rover:
        rover.send_keyframe(PICTURE, at(1))
        rover.send_pose(at(2))
        ground.wait(lambda: len(ground.samples) == 2)
    qualities = {
        str(sample.key_expr): (str(sample.encoding), sample.priority, sample.congestion_control, sample.express)
        for sample in ground.samples
    }
    drop, block_first = zenoh.CongestionControl.DROP, zenoh.CongestionControl.BLOCK_FIRST
    assert qualities == {
        keys.keyframe(SITE, "r1"): (codec.KEYFRAME_ENCODING, zenoh.Priority.DATA_LOW, block_first, False),
        keys.pose(SITE, "r1"): (codec.POSE_ENCODING, zenoh.Priority.INTERACTIVE_HIGH, drop, True),
    }


def test_a_station_that_comes_later_gets_the_newest(endpoint: str) -> None:
    with Rover("r1", CAMERA, endpoint) as rover:
        for x in range(3):
            rover.send_keyframe(PICTURE, at(x))
            rover.send_pose(at(10 + x))
        with Ground(endpoint) as ground:
            ground.wait(lambda: ground.keyframes and ground.poses)
            rover.send_pose(at(20))
            ground.wait(lambda: len(ground.poses) == 2)
            rover.close()
    assert [(k.sequence, k.pose) for k in ground.keyframes] == [(0, at(2))]
    assert [(p.sequence, p.pose) for p in ground.poses] == [(0, at(12)), (1, at(20))]
    assert (rover.keyframes_sent, rover.replaced, rover.poses_sent) == (1, 2, 2)


def test_what_is_said_while_the_router_is_away_is_said_when_it_is_back(endpoint: str) -> None:
    with Rover("r1", CAMERA, endpoint) as rover:
        with Ground(endpoint) as before:
            rover.send_keyframe(PICTURE, at(0))
            before.wait(lambda: before.keyframes)
            link = rover._link
            assert link is not None
        wait_until(lambda: not link.keyframes_wanted() and not link.poses_wanted())
        rover.send_keyframe(PICTURE, at(1))
        rover.send_pose(at(2))
        with Ground(endpoint) as after:
            after.wait(lambda: after.keyframes and after.poses and after.tokens)
            rover.close()
    assert [k.sequence for k in after.keyframes] == [1]
    assert [p.pose for p in after.poses] == [at(2)]


def test_closing_loses_nothing(endpoint: str, ground: Ground) -> None:
    large = Camera(fx=600, fy=600, cx=500, cy=400, width=1000, height=800)
    noise = np.random.default_rng(1).integers(0, 256, (800, 1000, 3), np.uint8)
    for k in range(5):
        with Rover(f"r{k}", large, endpoint) as rover:
            rover.send_keyframe(noise, at(k))
            rover.send_pose(at(k))
        assert rover.keyframes_sent == rover.poses_sent == 1
        assert ground.keyframes[-1].robot == f"r{k}"
    ground.wait(lambda: len(ground.poses) == 5)


def test_closing_waits_for_the_last_keyframe_to_be_confirmed(endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not for an older one, nor for one of another boot."""
    # What is asked before, since the link may be slow, would have some of the answers.
    monkeypatch.setattr(RoverLink, "delay_s", lambda *_: None)
    boot = "this"
    answers = [None, ("other", 7), (boot, 0), (boot, 1)]
    given: list[object] = []

    def answer(robot: str) -> RobotReport | None:
        given.append(known := answers[min(len(given), 3)])
        return report_on(robot, heard=known and KeyframeId(boot=known[0], sequence=known[1]))

    with Ground(endpoint, answer=answer) as ground:
        rover = Rover("r1", CAMERA, endpoint, boot=boot)
        for k in range(2):
            rover.send_keyframe(PICTURE, at(k))
            ground.wait(lambda k=k: len(ground.keyframes) == k + 1)
        rover.close()
        assert given == answers


def test_closing_does_not_wait_for_ever(
    endpoint: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(rover_module, "CLOSE_TIMEOUT_S", 0.2)
    with Ground(endpoint, answer=lambda robot: None) as ground:
        rover = Rover("r1", CAMERA, endpoint)
        rover.send_keyframe(PICTURE, at(0))
        ground.wait(lambda: ground.keyframes)
        began = time.monotonic()
        rover.close()
        assert time.monotonic() - began < 1.5
    assert "without the station's confirmation" in caplog.text


def test_without_a_station_there_is_nothing_to_wait_for(endpoint: str) -> None:
    began = time.monotonic()
    with Rover("r1", CAMERA, endpoint):
        pass
    assert time.monotonic() - began < 3


def test_a_token_says_that_the_robot_is_there(endpoint: str, ground: Ground) -> None:
    with Rover("r1", CAMERA, endpoint, boot="b7"), Rover("r2", CAMERA, endpoint, liveliness=False) as silent:
        silent.send_pose(at(0))
        ground.wait(lambda: ground.tokens and ground.poses)
        assert ground.tokens == {keys.alive(SITE, "r1", "b7")}
    ground.wait(lambda: not ground.tokens)


def test_each_start_is_another_boot(endpoint: str, ground: Ground) -> None:
    with Rover("r1", CAMERA, endpoint) as one, Rover("r1", CAMERA, endpoint) as other:
        assert one.boot != other.boot
        keys.check_id(one.boot)


def test_a_rover_hears_its_group_at_once_and_when_it_changes(endpoint: str, ground: Ground) -> None:
    heard: queue.SimpleQueue[OwnGroupReport] = queue.SimpleQueue()
    ground.tell_group("r1", "g1")
    with Rover("r1", CAMERA, endpoint) as rover:
        rover.on_group(heard.put)
        assert heard.get(timeout=DEADLINE_S).label == "g1"
        ground.tell_group("r2", "g9")
        ground.tell_group("r1", "g2", revision=2)
        assert heard.get(timeout=DEADLINE_S).label == "g2"
    ground.tell_group("r1", "g3", revision=3)
    assert heard.empty()


def test_a_callback_that_fails_does_not_end_the_news(
    endpoint: str, ground: Ground, caplog: pytest.LogCaptureFixture
) -> None:
    heard: queue.SimpleQueue[str | None] = queue.SimpleQueue()

    def callback(group: OwnGroupReport) -> None:
        heard.put(group.label)
        raise RuntimeError("of the robot's own making")

    with Rover("r1", CAMERA, endpoint) as rover:
        rover.on_group(callback)
        for label in ("g1", "g2"):
            ground.tell_group("r1", label)
            assert heard.get(timeout=DEADLINE_S) == label
    assert "of the robot's own making" in caplog.text


def test_a_callback_may_send(endpoint: str, ground: Ground) -> None:
    with Rover("r1", CAMERA, endpoint) as rover:
        rover.on_group(lambda group: rover.send_pose(at(group.revision)))
        ground.tell_group("r1", "g1", revision=4)
        ground.wait(lambda: [p.pose for p in ground.poses] == [at(4)])


def test_a_swarm_may_share_a_session(endpoint: str, ground: Ground) -> None:
    with zenoh.open(config("client", connect=[endpoint])) as session:
        for robot in ("r1", "r2"):
            with Rover(robot, CAMERA, session=session) as rover:
                rover.send_keyframe(PICTURE, at(0))
        assert not session.is_closed()
        ground.wait(lambda: not ground.tokens)
    assert [k.robot for k in ground.keyframes] == ["r1", "r2"]


def test_features_go_as_features(endpoint: str, ground: Ground) -> None:
    features = Features.from_arrays("orb", np.full((3, 2), 7.0), np.zeros((3, 32), np.uint8))
    with Rover("r1", CAMERA, endpoint, send="features+thumbnail") as rover:
        rover.send_keyframe(features, at(0))
        ground.wait(lambda: len(ground.keyframes) == 1)
        rover.send_keyframe(PICTURE, at(1))
    given, extracted = ground.keyframes
    assert given.features is not None
    assert len(given.features) == 3
    assert given.thumbnail is None
    assert extracted.features is not None
    assert extracted.thumbnail is not None


def test_one_picture_that_cannot_be_sent_does_not_silence_the_rover(
    endpoint: str, ground: Ground, caplog: pytest.LogCaptureFixture
) -> None:
    broken = b"\xff\xd8\xff and no more"
    with caplog.at_level(logging.ERROR), Rover("r1", CAMERA, endpoint, send="features") as rover:
        rover.send_keyframe(broken, at(0))
        wait_until(lambda: rover._outbox.drain(0))
        rover.send_keyframe(PICTURE, at(1))
    assert [k.pose for k in ground.keyframes] == [at(1)]
    assert "cannot decode" in caplog.text
    assert rover.keyframes_sent == 1


def test_misuse_is_named_at_once(endpoint: str, ground: Ground) -> None:
    for wrong in ("R1", "r 1", ""):
        with pytest.raises(ValueError, match=r"^robot "):
            Rover(wrong, CAMERA, endpoint)
    with pytest.raises(ValueError, match=r"^send: "):
        Rover("r1", CAMERA, endpoint, send="video")
    with pytest.raises(LinkError, match="not an end point"):
        Rover("r1", CAMERA, "station:7447")
    with Rover("r1", CAMERA, endpoint) as rover:
        with pytest.raises(ValueError, match=r"^pose: "):
            rover.send_pose((0, 0, 0))
        with pytest.raises(ValueError, match=r"^image: "):
            rover.send_keyframe(PICTURE[:9], at(0))
    for closed in (lambda: rover.send_pose(at(0)), lambda: rover.send_keyframe(PICTURE, at(0))):
        with pytest.raises(LinkError, match="closed"):
            closed()
    rover.close()


def wait_until(condition: object) -> None:
    """Wait for what nobody announces."""
    assert callable(condition)
    deadline, pause = time.monotonic() + DEADLINE_S, threading.Event()
    while not condition():
        assert time.monotonic() < deadline
        pause.wait(0.01)


UNCLOSED = """
import sys, threading
from covista_clients.rover.link import RoverLink
from covista_clients import Camera, Rover

rover = Rover("r1", Camera(fx=60, fy=60, cx=31.5, cy=23.5, width=64, height=48), sys.argv[1])
told = threading.Event()
rover.on_group(lambda report: told.set())
assert told.wait(10)
"""


def test_a_rover_that_was_never_closed_leaves_at_the_end_of_its_program(endpoint: str, ground: Ground) -> None:
    ground.tell_group("r1", "A")
    ended = subprocess.run([sys.executable, "-c", UNCLOSED, endpoint], capture_output=True, text=True, timeout=30)
    assert (ended.returncode, ended.stderr) == (0, "")
    ground.wait(lambda: not ground.tokens)
