"""A robot that sends faster than surveys are done is seen all the same, and costs nobody else anything."""

from covista_service.station.events import SurveyPair

from tests.service.station.scenes import SEEN, Scene, pose


def jobs(effects) -> list[SurveyPair]:
    return [effect for effect in effects if isinstance(effect, SurveyPair)]


def used(scene: Scene, robot: str) -> int:
    keyframe = scene.snapshot.robots[robot].keyframe
    assert keyframe is not None
    return keyframe.sequence


def test_a_robot_whose_every_keyframe_is_followed_before_its_survey_is_done_is_seen() -> None:
    scene = Scene.of(capacity=1)
    scene.send("slow", pose(0.1))
    scene.send("hasty")
    told = scene.tick()
    for _ in range(12):
        under_way = jobs(told)
        for _ in range(3):
            scene.now_ns += 10_000_000
            scene.send("hasty")
        told = [effect for job in under_way for effect in scene.done(job, SEEN)]
        told += scene.wait(0.01)
    pair = scene.snapshot.pair("hasty", "slow")
    assert pair.overlap_a is not None
    assert pair.overlap_b is not None
    assert used(scene, "hasty") > 5


def test_what_waits_for_the_one_before_is_counted_and_the_newest_of_it_is_used() -> None:
    scene = Scene.of(capacity=1)
    scene.send("r1")
    scene.send("r2", pose(0.1))
    (job,) = jobs(scene.tick())
    for _ in range(3):
        scene.send("r1")
    counts = scene.snapshot.robots["r1"].keyframes
    assert (counts.received, counts.used, counts.replaced, counts.waiting) == (4, 1, 2, 1)
    assert used(scene, "r1") == 0
    scene.work([job], lambda job: SEEN)
    counts = scene.snapshot.robots["r1"].keyframes
    assert (counts.received, counts.used, counts.replaced, counts.waiting) == (4, 2, 2, 0)
    assert used(scene, "r1") == 3


def test_a_robot_that_nobody_surveys_has_its_newest_keyframe_in_use_at_once() -> None:
    scene = Scene.of(capacity=1)
    for number in range(4):
        scene.send("alone")
        scene.tick()
        assert used(scene, "alone") == number


def test_a_worker_that_does_not_come_back_holds_nobody_up_for_long() -> None:
    scene = Scene.of(capacity=1)
    scene.send("r1")
    scene.send("r2", pose(0.1))
    assert jobs(scene.tick())
    for _ in range(3):
        scene.send("r1")
        scene.wait(0.5)
        assert used(scene, "r1") == 0
    for number in range(4, 9):
        scene.send("r1")
        scene.wait(1.5)
        assert used(scene, "r1") >= number - 1


def test_nothing_is_left_of_what_waits_when_its_robot_is_forgotten() -> None:
    scene = Scene.of(capacity=1, live_after_s=0.2, gone_after_s=0.2, forget_after_s=0.5)
    scene.send("r1")
    scene.send("r2", pose(0.1))
    assert jobs(scene.tick())
    scene.send("r1")
    scene.wait(1)
    assert "r1" not in scene.snapshot.robots
    scene.wait(3)
    assert "r1" not in scene.snapshot.robots
