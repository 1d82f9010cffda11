"""Live, stale, gone, forgotten: by tokens and messages, and by nothing but the time that is handed in."""

import pytest
from covista_schemas.reports import Status
from covista_service.station.events import ExtractFeatures, FeaturesExtracted, MessageDropped, TokenLost, TokenSeen
from covista_service.station.ledger import FORGOTTEN, Counts

from tests.service.station.scenes import FEATURES, START_NS, S, Scene, happenings, pose


def status(scene: Scene, robot: str = "r1") -> Status:
    return scene.snapshot.robots[robot].status


def test_a_message_makes_a_robot_live_for_five_seconds() -> None:
    scene = Scene()
    scene.send("r1")
    assert happenings(scene.tick())[0] == ("status", "r1 is live")
    assert happenings(scene.wait(4.9)) == []
    assert happenings(scene.wait(0.1)) == [("status", "r1 is stale")]
    assert happenings(scene.wait(29.9)) == []
    assert happenings(scene.wait(0.1))[0] == ("status", "r1 is gone")
    assert status(scene) is Status.GONE


def test_a_token_keeps_a_silent_robot_live() -> None:
    scene = Scene()
    scene.receive(TokenSeen("r1", "b0"))
    scene.tick()
    assert happenings(scene.wait(10_000)) == []
    assert status(scene) is Status.LIVE


def test_a_bounce_of_all_tokens_is_not_news() -> None:
    scene = Scene()
    robots = ("r1", "r2", "r3")
    scene.receive(*(TokenSeen(robot, "b0") for robot in robots))
    scene.wait(100)
    scene.receive(*(TokenLost(robot, "b0") for robot in robots))
    assert happenings(scene.wait(4.5)) == []
    scene.receive(*(TokenSeen(robot, "b0") for robot in robots))
    assert happenings(scene.wait(100)) == []


def test_a_lost_token_counts_until_five_seconds_later() -> None:
    scene = Scene()
    scene.receive(TokenSeen("r1", "b0"))
    scene.wait(100)
    scene.receive(TokenLost("r1", "b0"))
    assert happenings(scene.wait(5)) == [("status", "r1 is stale")]


def test_the_token_of_an_earlier_boot_may_go_without_harm() -> None:
    scene = Scene()
    scene.receive(TokenSeen("r1", "b0"), TokenSeen("r1", "b1"), TokenLost("r1", "b0"), TokenLost("r1", "b7"))
    scene.wait(1000)
    assert status(scene) is Status.LIVE


def test_a_robot_is_forgotten_ten_minutes_after_its_last_sign_of_life() -> None:
    scene = Scene()
    scene.send("r1")
    scene.wait(599.9)
    assert "r1" in scene.snapshot.robots
    assert ("status", "r1 is forgotten") in happenings(scene.wait(0.1))
    assert "r1" not in scene.snapshot.robots
    assert scene.snapshot.groups.ungrouped == ()


def test_a_robot_that_comes_back_continues() -> None:
    scene = Scene()
    scene.send("r1")
    scene.send("r2")
    scene.settle()
    scene.receive(TokenSeen("r2", "b0"))
    scene.wait(40)
    assert scene.snapshot.groups.ungrouped == (("r1", "gone"),)
    assert scene.snapshot.robots["r1"].group is None
    scene.send("r1", pose(1.0))
    told = happenings(scene.tick())
    assert told[0] == ("status", "r1 is live")
    assert ("join", "r1 joined g1") in told
    assert scene.snapshot.robots["r1"].keyframes.used == 2
    assert scene.snapshot.pair("r1", "r2").overlap_a == 0.5


def test_a_robot_that_comes_back_after_it_was_forgotten_starts_anew() -> None:
    scene = Scene()
    scene.send("r1", image=True)
    scene.wait(700)
    scene.send("r1")
    scene.tick()
    assert scene.snapshot.robots["r1"].keyframes.received == 1
    assert scene.snapshot.robots["r1"].keyframes.missing == 1


def test_without_a_pose_a_robot_stands_in_no_group() -> None:
    scene = Scene()
    scene.receive(TokenSeen("r1", "b0"))
    scene.tick()
    assert scene.snapshot.groups.ungrouped == (("r1", "no_pose"),)
    assert scene.snapshot.robots["r1"].boot == "b0"
    scene.send_pose("r1", pose())
    scene.tick()
    assert scene.snapshot.groups.ungrouped == ()
    assert scene.snapshot.robots["r1"].group == "g1"


def test_a_stale_robot_stays_in_its_group() -> None:
    scene = Scene()
    scene.send("r1")
    scene.send("r2")
    scene.settle()
    scene.wait(20)
    assert {view.status for view in scene.snapshot.robots.values()} == {Status.STALE}
    assert scene.snapshot.groups.groups[0].robots == ("r1", "r2")


def test_a_broken_message_is_a_sign_of_life_and_its_reason_can_be_read() -> None:
    scene = Scene()
    scene.receive(MessageDropped("r1", "keyframe", "bad_pose", "pose: nan is not finite", scene.now_ns, counted=False))
    scene.tick()
    view = scene.snapshot.robots["r1"]
    assert view.status is Status.LIVE
    assert view.last_problem == "pose: nan is not finite"
    assert view.keyframes.dropped == {"bad_pose": 1}


@pytest.mark.parametrize("offset_s", [-3600, 0, 3600])
def test_a_clock_that_is_off_is_shown_and_not_punished(offset_s: int) -> None:
    scene = Scene()
    scene.send("r1", time_ns=START_NS + offset_s * S)
    scene.send("r2")
    scene.settle()
    view = scene.snapshot.robots["r1"]
    assert view.clock_offset_s == offset_s
    assert view.last_seen_ns == START_NS
    assert view.status is Status.LIVE
    assert scene.snapshot.pair("r1", "r2").age_s == 0


def test_times_of_presence_are_settings() -> None:
    scene = Scene.of(live_after_s=1, gone_after_s=2, forget_after_s=4)
    scene.send("r1")
    scene.tick()
    states = [scene.wait(1) and status(scene) for _ in range(3)]
    assert states[0] is Status.STALE
    assert states[2] is Status.GONE
    scene.wait(1)
    assert "r1" not in scene.snapshot.robots


def test_a_forgotten_robot_leaves_its_accounts_behind() -> None:
    scene = Scene.of(live_after_s=1, gone_after_s=2, forget_after_s=4)
    for _ in range(2):
        scene.send("r1")
        scene.send_pose("r1", pose())
        scene.settle()
        scene.wait(2)
        assert "r1" in scene.snapshot.robots
        scene.wait(2)
        assert "r1" not in scene.snapshot.robots
    # Of the second life the first message is missing, as of any robot that sent before the station heard of it.
    assert scene.station.census().accounts["keyframe"] == Counts(received=2, used=2, missing=1)
    assert scene.station.census().accounts["pose"] == Counts(received=2, used=2, missing=1)


def test_a_picture_whose_robot_is_forgotten_meanwhile_is_dropped() -> None:
    scene = Scene.of(live_after_s=1, gone_after_s=2, forget_after_s=4)
    (job,) = scene.send("r1", image=True)
    assert isinstance(job, ExtractFeatures)
    scene.wait(4)
    scene.receive(FeaturesExtracted(job.keyframe.id, FEATURES))
    assert scene.station.census().accounts["keyframe"] == Counts(received=1, dropped={FORGOTTEN: 1})


def test_everybody_is_looked_at_ten_times_a_second_and_who_is_heard_of_at_once() -> None:
    scene = Scene()
    scene.send("r1")
    scene.send("r2")
    scene.tick()
    scene.wait(4.95)
    assert happenings(scene.wait(0.05)) == []
    assert happenings(scene.wait(0.05)) == [("status", "r1 is stale"), ("status", "r2 is stale")]
    scene.send_pose("r2", pose(1))
    assert happenings(scene.tick())[0] == ("status", "r2 is live")
    scene.now_ns -= 3600 * S
    scene.receive(TokenSeen("r1", "b0"))
    assert ("status", "r1 is live") in happenings(scene.tick())
