from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from covista_clients.simulation.pacing import AtOnce, Due, schedule
from covista_clients.simulation.swarm import (
    ROUND_S,
    KeyframeRecord,
    Progress,
    Swarm,
    SwarmOptions,
    come_so_far_s,
    drive,
    names,
    swarm,
)
from covista_schemas.messages import Pose
from numpy.typing import NDArray

OPTIONS = SwarmOptions(robots=3, world="wall", rate_hz=2, pose_rate_hz=5, width=160, height=120)


@dataclass(frozen=True)
class Taken:
    boot: str
    sequence: int


@dataclass
class Recorder:
    """Takes what a rover would send, and keeps it."""

    poses: list[Pose] = field(default_factory=list)
    keyframes: list[tuple[NDArray[np.uint8], Pose]] = field(default_factory=list)

    def send_pose(self, pose: Pose) -> None:
        self.poses.append(pose)

    def send_keyframe(self, image: NDArray[np.uint8], pose: Pose) -> Taken:
        self.keyframes.append((image, pose))
        return Taken("b", len(self.keyframes) - 1)


class Late(AtOnce):
    """A machine that falls behind by a second once, at second 1, and takes its time to catch up."""

    def now_s(self) -> float:
        due_s = super().now_s()
        return max(due_s, 2.0) if due_s >= 1 else due_s


@pytest.fixture(scope="module")
def built() -> Swarm:
    return swarm(OPTIONS)


def driven(built: Swarm, seconds: float) -> tuple[list[Recorder], list[KeyframeRecord], Progress]:
    recorders, progress = [Recorder() for _ in range(3)], Progress()
    return recorders, list(drive(built, recorders, AtOnce(), 10**18, seconds, progress)), progress


def test_everyone_sends_at_its_rates(built: Swarm) -> None:
    recorders, records, progress = driven(built, 4.0)
    assert [len(recorder.keyframes) for recorder in recorders] == [8, 8, 8]
    assert [len(recorder.poses) for recorder in recorders] == [20, 20, 20]
    assert (progress.keyframes, progress.poses, progress.skipped, progress.most_behind_s) == (24, 60, 0, 0)
    assert [record.sequence for record in records if record.robot == "r2"] == list(range(8))
    assert {record.robot for record in records} == set(names(OPTIONS))


def test_records_carry_the_pose_sent(built: Swarm) -> None:
    recorders, records, _ = driven(built, 1.0)
    sent = [pose for _, pose in recorders[1].keyframes]
    assert [record.pose for record in records if record.robot == "r2"] == sent
    assert [pose.time_ns for pose in sent] == [10**18 + 166_666_667, 10**18 + 666_666_667]


def test_the_same_options_send_the_same_pictures(built: Swarm) -> None:
    (first, *_), (again, *_) = driven(built, 1.0)[0], driven(swarm(OPTIONS), 1.0)[0]
    for (image, pose), (same_image, same_pose) in zip(first.keyframes, again.keyframes, strict=True):
        assert pose == same_pose
        np.testing.assert_array_equal(image, same_image)


def test_a_rover_alone_sends_what_it_sends_among_others(built: Swarm) -> None:
    together, _, _ = driven(built, 2.0)
    alone, progress = Recorder(), Progress()
    records = list(drive(swarm(replace(OPTIONS, only=("r2",))), [alone], AtOnce(), 10**18, 2.0, progress))
    assert {record.robot for record in records} == {"r2"}
    assert alone.poses == together[1].poses
    assert [pose for _, pose in alone.keyframes] == [pose for _, pose in together[1].keyframes]
    assert (progress.keyframes, progress.poses) == (4, 10)


def test_a_swarm_that_falls_behind_skips_and_says_so(built: Swarm) -> None:
    progress = Progress()
    list(drive(built, [Recorder() for _ in range(3)], Late(), 0, 4.0, progress))
    assert progress.most_behind_s == 1.0
    assert progress.behind_s == 0.0
    assert progress.skipped == 3
    assert progress.keyframes == 21


def test_rovers_driven_one_by_one_make_the_swarm_that_they_make_together() -> None:
    whole, since_s = swarm(OPTIONS), ROUND_S - 0.5
    for index, name in enumerate(names(OPTIONS)):
        alone, recorder = swarm(replace(OPTIONS, only=(name,))), Recorder()
        records = list(drive(alone, [recorder], AtOnce(), 10**18, 1.0, driven_s=since_s))
        assert [record.robot for record in records] == [name, name]
        for pose in recorder.poses:
            t_s = (pose.time_ns - 10**18) / 1e9
            # Where a round ends, the next one begins.
            expected = whole.paths.pose(index, (since_s + t_s) % ROUND_S, pose.time_ns)
            np.testing.assert_allclose(pose.position_m, expected.position_m, atol=1e-6)


def test_rovers_of_a_swarm_that_others_drive_are_where_the_clock_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "time", lambda: 7 * ROUND_S + 25.0)
    assert come_so_far_s(OPTIONS) == 0.0
    assert come_so_far_s(replace(OPTIONS, only=("r1",))) == pytest.approx(25.0)


def test_the_schedule_spreads_rovers_over_the_period() -> None:
    due = list(itertools.islice(schedule(4, 2.0, 0.0), 8))
    assert due == [Due(k / 8, k % 4, True) for k in range(8)]


def test_the_schedule_is_in_order() -> None:
    due = list(itertools.islice(schedule(3, 2.0, 10.0), 200))
    assert due == sorted(due)
    assert sum(item.is_keyframe for item in due) == pytest.approx(200 / 6, abs=2)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"robots": 0}, "at least 1"),
        ({"world": "moon"}, "arena"),
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"robots": 2, "only": ("r1", "r3")}, "a swarm of 2 has no robot r3"),
        ({"only": ("r7",)}, "has no robot r7"),
    ],
)
def test_options_that_make_no_sense_say_why(wrong: dict, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        SwarmOptions(**wrong)
