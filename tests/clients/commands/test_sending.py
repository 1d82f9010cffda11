import json
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from covista_schemas.reports import Counters, KeyframeId, RobotReport

from tests.clients.commands.conftest import Run
from tests.clients.ground import Ground, report_on

POSE = "-0.5 1 2 0 0 0.6 0.8"


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    path = tmp_path / "picture.png"
    cv2.imwrite(str(path), np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8))
    return path


@pytest.fixture
def camera(tmp_path: Path) -> Path:
    path = tmp_path / "camera.json"
    distortion = {"model": "plumb_bob", "coefficients": [0.1, 0, 0, 0]}
    values = {"fx": 60, "fy": 60, "cx": 31.5, "cy": 23.5, "width": 64, "height": 48, "distortion": distortion}
    path.write_text(json.dumps(values))
    return path


def test_one_keyframe_is_sent_and_confirmed(
    run: Run, endpoint: str, ground: Ground, picture: Path, camera: Path
) -> None:
    now_ns = time.time_ns()
    code, out, err = run("send", picture, "--robot", "r1", "--camera", camera, "--pose", POSE, "--connect", endpoint)
    assert (code, err) == (0, "")
    (keyframe,) = ground.keyframes
    assert keyframe.boot in out
    assert keyframe.image == picture.read_bytes()
    assert keyframe.camera.distortion.coefficients == (0.1, 0, 0, 0)
    assert keyframe.pose.position_m == (-0.5, 1, 2)
    assert keyframe.pose.orientation_xyzw == (0, 0, 0.6, 0.8)
    assert 0 <= keyframe.pose.time_ns - now_ns < 60e9
    assert not ground.tokens


def test_the_stations_reason_is_told(run: Run, endpoint: str, picture: Path, camera: Path) -> None:
    """Not the reason of an earlier message, and only once this one is refused."""
    reports: list[RobotReport] = []

    def answer(robot: str) -> RobotReport:
        refused = len(reports) > 3
        reports.append(
            report_on(
                robot,
                keyframe=KeyframeId(boot="other", sequence=9),
                keyframes=Counters(received=2, dropped={"bad_pose": 1, "bad_image": int(refused)}),
                heard=KeyframeId(boot=ground.keyframes[0].boot, sequence=0) if ground.keyframes else None,
                last_problem="image: truncated" if refused else "pose: not unit",
            )
        )
        return reports[-1]

    with Ground(endpoint, answer=answer) as ground:
        arguments = ("--robot", "r1", "--camera", camera, "--pose", POSE, "--connect", endpoint)
        code, out, err = run("send", picture, *arguments)
    assert (code, out) == (1, "")
    assert err.splitlines()[-1] == "covista: the station refused it: image: truncated"
    assert len(err.splitlines()) == 1


def test_silence_is_told(
    run: Run, endpoint: str, picture: Path, camera: Path, caplog: pytest.LogCaptureFixture
) -> None:
    arguments = ("send", picture, "--robot", "r1", "--camera", camera, "--pose", POSE, "--connect", endpoint)
    code, _, err = run(*arguments, "--wait", "0.2")
    assert (code, err) == (1, f"covista: no router at {endpoint} within 0.2 s\n")
    with Ground(endpoint, answer=lambda robot: None):
        code, _, err = run(*arguments, "--wait", "0.3")
    assert (code, err) == (1, "covista: sent, but no station answers\n")
    assert not caplog.records


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--pose", "1 2 3", "--pose '1 2 3' is not"),
        ("--pose", "1 2 3 0 0 0 x", "--pose '1 2 3 0 0 0 x' is not"),
        ("--pose", "1 2 3 0 0 0 2", "orientation_xyzw: a quaternion of norm 2, not 1"),
        ("--robot", "R 1", "robot 'R 1' does not match"),
        ("--site", "no/site", "site 'no/site' does not match"),
        ("--connect", "nonsense", "'nonsense' is not an end point"),
    ],
)
def test_what_is_wrong_is_one_line(
    run: Run, endpoint: str, ground: Ground, picture: Path, camera: Path, option: str, value: str, said: str
) -> None:
    arguments = {"--robot": "r1", "--camera": camera, "--pose": POSE, "--connect": endpoint} | {option: value}
    code, out, err = run("send", picture, *(word for pair in arguments.items() for word in pair))
    assert (code, out) == (1, "")
    assert said in err
    assert len(err.splitlines()) == 1
    assert not ground.keyframes


@pytest.mark.parametrize(("text", "said"), [("{", "Invalid JSON"), ('{"fx": 0}', "fx: "), ("[]", "camera: ")])
def test_a_camera_that_is_none_is_one_line(
    run: Run, endpoint: str, picture: Path, camera: Path, text: str, said: str
) -> None:
    camera.write_text(text)
    code, _, err = run("send", picture, "--robot", "r1", "--camera", camera, "--pose", POSE, "--connect", endpoint)
    assert code == 1
    assert str(camera) in err
    assert said in err
    assert len(err.splitlines()) == 1


def test_a_file_that_is_no_picture_is_one_line(run: Run, endpoint: str, ground: Ground, camera: Path) -> None:
    code, _, err = run("send", camera, "--robot", "r1", "--camera", camera, "--pose", POSE, "--connect", endpoint)
    assert code == 1
    assert err == "covista: image: bytes that are neither JPEG, PNG nor WebP\n"


def test_a_file_that_is_not_there_is_one_line(run: Run, picture: Path, camera: Path, tmp_path: Path) -> None:
    for image, intrinsics in ((tmp_path / "none.png", camera), (picture, tmp_path / "none.json"), (tmp_path, camera)):
        code, out, err = run("send", image, "--robot", "r1", "--camera", intrinsics, "--pose", POSE)
        assert (code, out) == (1, "")
        assert len(err.splitlines()) == 1
        assert "cannot be read" in err
