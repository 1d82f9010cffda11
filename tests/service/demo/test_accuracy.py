from __future__ import annotations

import pytest
from covista_clients.simulation import worlds
from covista_schemas.messages import Camera, Pose
from covista_schemas.reports import FoundBy, KeyframeId, PairKeyframes, PairSummary, PairTimes, time_of
from covista_service.demo.accuracy import Accuracy, rendered_overlap


def pose(x_m: float) -> Pose:
    return Pose((x_m, 0.0, 0.0))


def nearness(first: Pose, second: Pose) -> float:
    return max(0.0, 1 - abs(first.position_m[0] - second.position_m[0]))


def answer(overlap_a: float | None, overlap_b: float | None, keyframes: tuple[int, int] | None) -> PairSummary:
    named = keyframes and PairKeyframes(
        a=KeyframeId(boot="x", sequence=keyframes[0]), b=KeyframeId(boot="x", sequence=keyframes[1])
    )
    return PairSummary(
        a="r1", b="r2", overlap_a=overlap_a, overlap_b=overlap_b, found_by=FoundBy.IMAGE, outcome="measured",
        inliers=0, pose_source=None, age_s=None, keyframes=named,
    )  # fmt: skip


@pytest.fixture
def accuracy() -> Accuracy:
    judge = Accuracy(nearness, lambda robot, t_s: pose(0.0 if robot == "r1" else t_s / 10))
    for sequence, (x1, x2) in enumerate([(0.0, 0.5), (0.0, 0.95), (0.0, 0.2)]):
        judge.sent("r1", "x", sequence, pose(x1), sequence)
        judge.sent("r2", "x", sequence, pose(x2), sequence)
    return judge


def test_answers_are_judged_by_the_keyframes_that_they_name(accuracy: Accuracy) -> None:
    accuracy.judge(answer(0.5, 0.4, (0, 0)))
    assert accuracy.error.value == pytest.approx(0.05)
    accuracy.judge(answer(0.05, 0.05, (1, 1)))
    assert accuracy.error.count == 4
    assert accuracy.error_seen.count == 2


def at(seconds_a: float, seconds_b: float) -> PairTimes:
    return PairTimes(a=time_of(round(seconds_a * 1e9)), b=time_of(round(seconds_b * 1e9)))


def test_an_answer_for_newer_poses_is_judged_where_robots_stood_then() -> None:
    """r1 does not move; r2 drives a metre in ten seconds, and its clock is five seconds ahead of the swarm's."""
    judge = Accuracy(nearness, lambda robot, t_s: pose(0.0 if robot == "r1" else t_s / 10))
    judge.sent("r1", "x", 0, Pose((0.0, 0.0, 0.0), time_ns=2_000_000_000), 2.0)
    judge.sent("r2", "x", 0, Pose((0.2, 0.0, 0.0), time_ns=7_000_000_000), 2.0)
    judge.judge(answer(0.8, 0.8, (0, 0)))
    judge.judge(answer(0.8, 0.8, (0, 0)).model_copy(update={"poses": at(2, 7)}))
    assert judge.error.value == pytest.approx(0)
    judge.judge(answer(0.5, 0.5, (0, 0)).model_copy(update={"poses": at(2, 10)}))
    assert judge.error.value == pytest.approx(0)
    judge.judge(answer(0.8, 0.8, (0, 0)).model_copy(update={"poses": at(2, 10)}))
    assert judge.error.value == pytest.approx(2 * 0.3 / 8)


def test_no_answer_counts_as_nothing_in_common(accuracy: Accuracy) -> None:
    accuracy.judge(answer(None, None, None))
    assert accuracy.error.value == pytest.approx(0.8)


def test_keyframes_that_nobody_sent_are_left_out(accuracy: Accuracy) -> None:
    accuracy.judge(answer(0.5, 0.5, (0, 7)))
    assert accuracy.error.value is None


def test_a_view_sees_all_of_itself_in_a_rendered_world() -> None:
    world = worlds.build("wall")
    camera = Camera(fx=120, fy=120, cx=79.5, cy=59.5, width=160, height=120)
    (place,) = worlds.viewpoints(world, 1)
    assert rendered_overlap(world, camera)(place, place) == 1.0
