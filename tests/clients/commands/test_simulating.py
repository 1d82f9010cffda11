import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.clients.commands.conftest import Run
from tests.clients.ground import DEADLINE_S, Ground


def test_a_swarm_sends_and_leaves(run: Run, endpoint: str, ground: Ground) -> None:
    arguments = ("--robots", "2", "--world", "wall", "--rate", "5", "--seconds", "0.5", "--connect", endpoint)
    code, _, err = run("swarm", *arguments)
    assert code == 0
    assert {keyframe.robot for keyframe in ground.keyframes} == {"r1", "r2"}
    assert "keyframes and" in err.splitlines()[-1]
    ground.wait(lambda: not ground.tokens)


def test_one_rover_of_a_swarm_drives_alone(run: Run, endpoint: str, ground: Ground) -> None:
    arguments = ("--robots", "3", "--only", "r2", "--world", "wall", "--rate", "5", "--seconds", "0.5")
    code, _, err = run("swarm", *arguments, "--connect", endpoint)
    assert code == 0
    assert {keyframe.robot for keyframe in ground.keyframes} == {"r2"}
    assert err.splitlines()[0].startswith("r2 of 3 rovers in wall send to")
    ground.wait(lambda: not ground.tokens)


def test_a_swarm_leaves_when_it_is_interrupted(endpoint: str, ground: Ground) -> None:
    options = ["--robots", "1", "--world", "wall", "--connect", endpoint, "--send", "features"]
    command = [sys.executable, "-m", "covista_clients", "swarm", *options]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        ground.wait(lambda: ground.keyframes)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 0
    assert len(err.splitlines()) == 2
    assert ground.keyframes[0].features is not None
    ground.wait(lambda: not ground.tokens)


def test_a_crowd_sends_what_was_made_before(run: Run, endpoint: str, ground: Ground) -> None:
    arguments = ("--robots", "8", "--world", "wall", "--rate", "4", "--pose-rate", "2", "--send", "features")
    code, _, err = run("swarm", *arguments, "--seconds", "0.5", "--connect", endpoint)
    assert code == 0
    ground.wait(lambda: len(ground.keyframes) == 16 and len(ground.poses) == 8)
    assert {keyframe.robot for keyframe in ground.keyframes} == {f"r{k + 1}" for k in range(8)}
    lines = err.splitlines()
    assert lines[0].startswith("8 rovers in wall send to")
    assert lines[1] == "72 of 72 keyframes are made"
    fates = "0 of those replaced by newer ones before they went out, 0 skipped"
    assert lines[2].startswith(f"16 keyframes and 8 poses, {fates}, at most 0.0")
    ground.wait(lambda: not ground.tokens)


@pytest.mark.parametrize(("robots", "send"), [(2, "image"), (8, "features")])
def test_a_swarm_says_what_it_has_sent(run: Run, endpoint: str, ground: Ground, robots: int, send: str) -> None:
    arguments = ("--robots", robots, "--send", send, "--world", "wall", "--rate", 4, "--accounts", 60)
    code, out, _ = run("swarm", *arguments, "--seconds", "0.5", "--connect", endpoint)
    assert code == 0
    told = [json.loads(line) for line in out.splitlines()]
    ground.wait(lambda: len(ground.keyframes) == sum(account["keyframes"] for account in told))
    ground.wait(lambda: len(ground.poses) == sum(account["poses"] for account in told))
    assert {(account["robot"], account["boot"]) for account in told} == {(k.robot, k.boot) for k in ground.keyframes}


def test_a_swarm_goes_by_the_clock_that_it_is_given(run: Run, endpoint: str, ground: Ground) -> None:
    arguments = ("--robots", "1", "--world", "wall", "--seconds", "0.5", "--connect", endpoint)
    before_ns = time.time_ns()
    assert run("swarm", *arguments, "--clock-offset", "-86400")[0] == 0
    ground.wait(lambda: ground.keyframes and ground.poses)
    day_ns = 86_400 * 10**9
    for said in (ground.keyframes[0], ground.poses[0]):
        assert before_ns <= said.pose.time_ns + day_ns <= time.time_ns()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("swarm", "--clock-offset", "nan"), "clock_offset_s = nan is not within 1e+09 s"),
        (("swarm", "--world", "moon"), "there is no world 'moon'"),
        (("swarm", "--robots", "3", "--only", "r4"), "a swarm of 3 has no robot r4, but r1 to r3"),
        (("swarm", "--rate", "0"), "rate_hz must be positive"),
        (("swarm", "--rate", "inf"), "rate_hz must be positive"),
        (("swarm", "--pose-rate", "-1"), "pose_rate_hz not negative"),
        (("swarm", "--pose-rate", "nan", "--send", "features", "--robots", "1000"), "pose_rate_hz not negative"),
        (("swarm", "--connect", "nonsense"), "'nonsense' is not an end point"),
        (("swarm", "--site", "no site", "--seconds", "0"), "site 'no site' does not match"),
        (("render", "moon", "--out", "."), "moon"),
    ],
)
def test_what_makes_no_sense_is_one_line(run: Run, arguments: tuple[str, ...], said: str) -> None:
    code, out, err = run(*arguments)
    assert (code, out) == (1, "")
    assert said in err
    assert len([line for line in err.splitlines() if line.startswith("covista: ")]) == 1


def test_a_world_is_rendered_into_a_folder(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "wall"
    assert run("render", "wall", "--cameras", "2", "--seed", "3", "--out", out)[0] == 0
    assert len(json.loads((out / "dataset.json").read_text())["frames"]) == 2
    assert (out / "overlap_gt.json").exists()


def test_without_opencv_it_says_what_to_install(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("covista_clients.simulation")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "cv2", None)
    code, _, err = run("swarm")
    assert code == 1
    assert err == "covista: covista swarm needs an optional extra: pip install 'covista[vision]'\n"


@pytest.mark.parametrize("arguments", [("swarm", "--seconds", "0"), ("render", "wall", "--out", ".")])
def test_a_seed_is_not_negative(run: Run, arguments: tuple[str, ...]) -> None:
    code, out, err = run(*arguments, "--seed", "-1")
    assert (code, out) == (2, "")
    assert "--seed" in err
