"""From message to keyframe in use: newest wins, and every message has a fate."""

import numpy as np
import pytest
from covista_service.station.events import (
    ExtractFeatures,
    FeaturesExtracted,
    KeyframeArrived,
    KeyframeId,
    MessageDropped,
    MessagesReceived,
    TokenSeen,
)
from covista_service.station.ledger import Counts
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.scenes import FEATURES, START_NS, S, Scene, pose


def extractions(effects) -> list[KeyframeId]:
    return [effect.keyframe.id for effect in effects if isinstance(effect, ExtractFeatures)]


def counts(scene: Scene, robot: str = "r1") -> Counts:
    return scene.snapshot.robots[robot].keyframes


def position_m(scene: Scene, robot: str = "r1") -> list[float]:
    fix = scene.snapshot.robots[robot].fix
    return [] if fix is None else fix.pose.centre_m.tolist()


def test_a_keyframe_with_features_is_used_at_once() -> None:
    scene = Scene()
    assert scene.send("r1") == []
    assert counts(scene) == Counts(received=1, used=1)
    assert scene.snapshot.robots["r1"].keyframe == KeyframeId("r1", "b0", 0)


def test_an_image_is_extracted_first() -> None:
    scene = Scene()
    assert extractions(scene.send("r1", image=True)) == [KeyframeId("r1", "b0", 0)]
    assert counts(scene) == Counts(received=1, waiting=1)
    assert scene.snapshot.robots["r1"].keyframe is None
    scene.receive(FeaturesExtracted(KeyframeId("r1", "b0", 0), FEATURES))
    assert counts(scene) == Counts(received=1, used=1)
    assert scene.snapshot.robots["r1"].keyframe == KeyframeId("r1", "b0", 0)


def test_an_image_that_cannot_be_used_is_dropped_with_its_reason() -> None:
    scene = Scene()
    scene.send("r1", image=True)
    scene.receive(FeaturesExtracted(KeyframeId("r1", "b0", 0), None, code="truncated", problem="image ends early"))
    assert counts(scene) == Counts(received=1, dropped={"truncated": 1})
    assert scene.snapshot.robots["r1"].last_problem == "image ends early"


def test_a_keyframe_that_waits_is_replaced_by_a_newer_one_and_one_under_way_is_used() -> None:
    scene = Scene()
    assert len(extractions(scene.send("r1", image=True))) == 1
    assert extractions(scene.send("r1", image=True)) == []
    assert extractions(scene.send("r1", image=True)) == []
    assert counts(scene) == Counts(received=3, waiting=2, replaced=1)
    effects = scene.receive(FeaturesExtracted(KeyframeId("r1", "b0", 0), FEATURES))
    assert extractions(effects) == [KeyframeId("r1", "b0", 2)]
    scene.receive(FeaturesExtracted(KeyframeId("r1", "b0", 2), FEATURES))
    assert counts(scene) == Counts(received=3, used=2, replaced=1)


def test_features_supersede_an_image_under_way() -> None:
    scene = Scene()
    scene.send("r1", image=True)
    scene.send("r1")
    scene.receive(FeaturesExtracted(KeyframeId("r1", "b0", 0), FEATURES))
    assert counts(scene) == Counts(received=2, used=1, replaced=1)
    assert scene.snapshot.robots["r1"].keyframe == KeyframeId("r1", "b0", 1)


def test_no_more_extractions_are_under_way_than_there_are_hands() -> None:
    scene = Scene.of(capacity=2)
    under_way: list[KeyframeId] = []
    for robot in ("r1", "r2", "r3", "r4"):
        under_way += extractions(scene.send(robot, image=True))
    assert [name.robot for name in under_way] == ["r1", "r2"]
    served = []
    while under_way:
        served.append(under_way.pop(0))
        under_way += extractions(scene.receive(FeaturesExtracted(served[-1], FEATURES)))
        assert len(under_way) <= 2
    assert [name.robot for name in served] == ["r1", "r2", "r3", "r4"]


def test_every_robot_gets_its_extraction_while_one_never_stops_sending() -> None:
    scene = Scene.of(capacity=1)
    under_way = extractions(scene.send("a", image=True))
    for robot in ("b", "c", "d"):
        scene.send(robot, image=True)
    served = []
    for _ in range(8):
        scene.send("a", image=True)
        served.append(under_way[0].robot)
        under_way = extractions(scene.receive(FeaturesExtracted(under_way[0], FEATURES)))
    assert {"b", "c", "d"} <= set(served[:7])


def test_an_older_keyframe_of_the_same_boot_is_replaced() -> None:
    scene = Scene()
    scene.send("r1", pose(5), sequence=4)
    scene.send("r1", pose(3), sequence=2)
    assert counts(scene) == Counts(received=2, used=1, replaced=1, missing=3)
    assert position_m(scene) == [5, 0, 0]


def test_a_new_boot_starts_over_and_the_old_one_is_over() -> None:
    scene = Scene()
    scene.send("r1", pose(1), boot="b0", sequence=7)
    scene.send("r1", pose(2), boot="b1", sequence=0, time_ns=START_NS - 3 * S)
    assert scene.snapshot.robots["r1"].keyframe == KeyframeId("r1", "b1", 0)
    assert position_m(scene) == [2, 0, 0]
    scene.send("r1", pose(3), boot="b0", sequence=8)
    assert scene.snapshot.robots["r1"].boot == "b1"
    assert counts(scene) == Counts(received=3, used=2, replaced=1, missing=7)


def two_senders() -> Scene:
    """A robot, and a keyframe of another boot sent under its id."""
    scene = Scene()
    scene.send("r1", pose(1), boot="b0")
    scene.send("r1", pose(9), boot="hand")
    return scene


def test_two_senders_under_one_id_are_told_of() -> None:
    scene = two_senders()
    scene.send("r1", pose(2), boot="b0")
    assert counts(scene) == Counts(received=3, used=2, replaced=1)
    assert "do two robots share this id" in str(scene.snapshot.robots["r1"].last_problem)


def test_a_robot_is_heard_again_when_the_other_sender_is_over() -> None:
    scene = two_senders()
    scene.wait(5)
    scene.send("r1", pose(2), boot="b0")
    scene.send_pose("r1", pose(3), boot="b0")
    assert counts(scene) == Counts(received=3, used=3)
    assert position_m(scene) == [3, 0, 0]


def test_a_late_message_of_an_earlier_boot_does_not_bring_it_back_while_the_robot_is_there() -> None:
    scene = Scene()
    scene.send("r1", pose(1), boot="b0")
    scene.receive(TokenSeen("r1", "b1"))
    scene.send("r1", pose(2), boot="b1")
    scene.wait(60)
    scene.send("r1", pose(3), boot="b0")
    assert scene.snapshot.robots["r1"].boot == "b1"
    assert position_m(scene) == [2, 0, 0]


def test_two_robots_that_both_send_for_ever_leave_nothing_behind() -> None:
    scene = Scene()
    for _ in range(40):
        for boot in ("b0", "b1"):
            scene.wait(6)
            scene.send("r1", boot=boot)
    assert counts(scene) == Counts(received=80, used=80)


def test_a_repeated_keyframe_is_a_duplicate_and_used_once() -> None:
    scene = Scene()
    scene.send("r1", pose(1), sequence=0)
    scene.send("r1", pose(2), sequence=0)
    assert counts(scene) == Counts(received=2, used=1, duplicate=1)
    assert position_m(scene) == [1, 0, 0]


def test_a_keyframe_that_was_not_announced_is_counted_all_the_same() -> None:
    scene = Scene()
    scene.receive(KeyframeArrived(scene.keyframe("r1")))
    assert counts(scene) == Counts(received=1, used=1)


def test_the_newest_pose_counts_wherever_it_came_from() -> None:
    scene = Scene()
    scene.send("r1", pose(1))
    scene.send_pose("r1", pose(2), time_ns=scene.now_ns + 1)
    assert position_m(scene) == [2, 0, 0]
    scene.send_pose("r1", pose(3), time_ns=scene.now_ns - S)
    assert position_m(scene) == [2, 0, 0]
    scene.send("r1", pose(4), time_ns=scene.now_ns + 2)
    assert position_m(scene) == [4, 0, 0]
    assert scene.snapshot.robots["r1"].poses == Counts(received=2, used=1, replaced=1)


def test_a_robot_whose_clock_is_set_back_is_not_frozen() -> None:
    scene = Scene()
    scene.send_pose("r1", pose(1), time_ns=START_NS)
    scene.send_pose("r1", pose(2), time_ns=START_NS - 3600 * S)
    assert position_m(scene) == [2, 0, 0]


def test_a_late_pose_message_is_replaced() -> None:
    scene = Scene()
    scene.send_pose("r1", pose(2), sequence=5)
    scene.send_pose("r1", pose(1), sequence=4, time_ns=scene.now_ns + S)
    assert position_m(scene) == [2, 0, 0]


MESSAGES = st.tuples(
    st.sampled_from(["keyframe", "image", "pose", "broken", "extracted", "unusable", "wait"]),
    st.sampled_from(["r1", "r2"]),
    st.sampled_from(["b0", "b1", "b2"]),
    st.integers(0, 9),
)


@given(st.lists(MESSAGES, max_size=60))
@settings(deadline=None)
def test_accounts_balance_whatever_comes(messages: list[tuple[str, str, str, int]]) -> None:
    scene = Scene()
    under_way: list[KeyframeId] = []
    for kind, robot, boot, sequence in messages:
        effects = []
        if kind in ("keyframe", "image"):
            effects = scene.send(robot, boot=boot, sequence=sequence, image=kind == "image")
        elif kind == "pose":
            scene.send_pose(robot, pose(), boot=boot, sequence=sequence)
        elif kind == "broken":
            name = (boot, sequence)
            scene.receive(
                MessagesReceived(robot, "keyframe", (name,), name, scene.now_ns),
                MessageDropped(robot, "keyframe", "bad", "bad", scene.now_ns, counted=True),
            )
        elif kind == "wait":
            effects = scene.wait(70 * sequence)
        elif under_way:
            features = FEATURES if kind == "extracted" else None
            effects = scene.receive(FeaturesExtracted(under_way.pop(0), features, code="bad", problem="bad"))
        under_way += extractions(effects)
        for view in scene.snapshot.robots.values():
            for account in (view.keyframes, view.poses):
                fates = account.used + account.replaced + account.duplicate + account.waiting
                assert account.received == fates + sum(account.dropped.values())


@pytest.mark.parametrize("event", [FeaturesExtracted(KeyframeId("r9", "b", 0), FEATURES)])
def test_news_of_the_unknown_changes_nothing(event) -> None:
    scene = Scene()
    assert scene.receive(event) == []
    assert scene.snapshot.robots == {}
    np.testing.assert_array_equal(scene.snapshot.similarity.similarity, np.zeros((0, 0)))


def test_the_hands_of_a_robot_that_is_forgotten_are_full_until_they_are_back() -> None:
    scene = Scene.of(capacity=2, forget_after_s=1.0, live_after_s=0.5, gone_after_s=0.1)
    under_way: list[KeyframeId] = []
    for turn in range(12):
        for robot in ("r1", "r2", "r3"):
            under_way += extractions(scene.send(robot, image=True, sequence=turn))
        under_way += extractions(scene.wait(1.5))
        assert scene.snapshot.robots == {}
        assert len(under_way) == 2
        if turn % 3 == 2:
            keyframe = under_way.pop(0)
            scene.receive(FeaturesExtracted(keyframe, FEATURES if turn % 2 else None, code="bad_image"))
    assert scene.station._keyframes._extractions._abandoned.total() == 1
