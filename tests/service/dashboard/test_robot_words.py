"""Sentences say what is, for every state of a robot; reasons are those that rovers are told of."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from covista_schemas.reports import Status
from covista_service.dashboard import robot_words
from covista_service.dashboard.reasons import DROPPED, UNTOLD
from covista_service.station.corrections import Correction
from covista_service.station.ledger import Counts
from covista_service.station.snapshot import RobotView

from tests.service.dashboard.conftest import PagesDesk
from tests.service.station.scenes import Scene, pose


@pytest.fixture
def scene() -> Scene:
    scene = Scene()
    scene.send("r1")
    scene.send("r2")
    scene.settle()
    return scene


def view(scene: Scene, robot: str = "r1") -> RobotView:
    return scene.snapshot.robots[robot]


def test_a_live_robot_says_with_whom_it_is(scene: Scene) -> None:
    first, second = robot_words.standing(scene.snapshot, view(scene))
    assert first.startswith("r1 is live")
    assert second == f"It stands in {view(scene).group}, with r2."


def test_silence_is_told_and_how_long(scene: Scene) -> None:
    scene.wait(20)
    assert robot_words.standing(scene.snapshot, view(scene))[0] == "r1 is stale: nothing came from it for 20 s."
    scene.wait(100)
    gone = robot_words.standing(scene.snapshot, view(scene))
    assert gone[0].startswith("r1 is gone: nothing came from it for 2 min.")
    assert gone[1] == "So it stands in no group."


def test_every_status_has_a_sentence(scene: Scene) -> None:
    for status in Status:
        for seen_ns in (None, scene.now_ns):
            told = robot_words.standing(scene.snapshot, replace(view(scene), status=status, last_seen_ns=seen_ns))
            assert told[0].startswith(f"r1 is {status}")
            assert told[0].endswith(".")


def test_neighbours_that_are_not_live_are_named_with_their_silence(pages_desk: PagesDesk) -> None:
    for robot in ("r1", "r2", "r3"):
        pages_desk.scene.send(robot)
    pages_desk.scene.settle()
    assert pages_desk.data("/robots/r1/words")["silent"] == {}
    pages_desk.scene.wait(20)
    pages_desk.scene.send_pose("r1", pose())
    pages_desk.scene.send_pose("r3", pose())
    pages_desk.scene.settle()
    silent = pages_desk.data("/robots/r1/words")["silent"]
    beside = {robot["id"]: robot for robot in pages_desk.data("/pair?a=r1&b=r2")["robots"]}
    assert silent == {"r2": {"status": "stale", "silent_s": beside["r2"]["silent_s"]}}
    assert silent["r2"]["silent_s"] >= 20


@pytest.mark.parametrize(
    ("offset_s", "words"),
    [
        (None, "Nothing is known of its clock yet."),
        (0.1, "goes with the station's"),
        (-0.2, "goes with the station's"),
        (3.2, "Its clock is 3.2 s ahead of the station's."),
        (-75.0, "Its clock is 75 s behind the station's, or its messages take as long."),
        (86_400.0, "24.0 h ahead"),
    ],
)
def test_clocks_in_words(offset_s: float | None, words: str) -> None:
    assert words in robot_words.clock(offset_s)


def test_poses_in_words(scene: Scene) -> None:
    robot = view(scene)
    assert robot_words.pose(replace(robot, fix=None)) == "It has told no pose yet."
    assert "cannot be told" in robot_words.pose(replace(robot, correction=None))
    assert "is right" in robot_words.pose(replace(robot, correction=Correction(0.6, 0.01, disagreeing=0)))
    once = robot_words.pose(replace(robot, correction=Correction(4.2, 0.3, disagreeing=1)))
    often = robot_words.pose(replace(robot, correction=Correction(4.2, 0.3, disagreeing=5)))
    assert once == "By the images its pose is off by 4.2 degrees and 0.30 m."
    assert often == "By the images its pose is off by 4.2 degrees and 0.30 m, 5 keyframes in a row."


def test_what_was_dropped_most_comes_first_with_its_meaning(scene: Scene) -> None:
    keyframes, poses = Counts(dropped={"bad_image": 2, "of_later": 1}), Counts(dropped={"bad_pose": 7})
    told = robot_words.dropped(replace(view(scene), keyframes=keyframes, poses=poses))
    assert [(each["of"], each["reason"], each["count"]) for each in told] == [
        ("poses", "bad_pose", 7),
        ("keyframes", "bad_image", 2),
        ("keyframes", "of_later", 1),
    ]
    assert told[0]["meaning"] == DROPPED["bad_pose"].means
    assert told[2]["meaning"] == UNTOLD.means


def test_pictures_are_told_apart_and_their_absence_is_explained(scene: Scene) -> None:
    robot = view(scene)
    assert robot.in_use is not None
    assert robot_words.picture(None)["key"] is None
    assert robot_words.picture(replace(robot.in_use, features=None))["key"] is None
    assert "keypoints" in robot_words.picture(robot.in_use)["words"]
    assert "thumbnail" in robot_words.picture(replace(robot.in_use, thumbnail=b"jpeg"))["words"]
    assert robot_words.picture(replace(robot.in_use, image=b"jpeg"))["words"] == "Its newest keyframe."
    first = robot_words.picture(robot.in_use)["key"]
    scene.send("r1")
    scene.settle()
    assert robot_words.picture(view(scene).in_use)["key"] != first


def test_many_names_are_cut_short() -> None:
    names = [f"r{k}" for k in range(1, 21)]
    assert robot_words.listed(["r1"]) == "r1"
    assert robot_words.listed(["r1", "r2", "r3"]) == "r1, r2 and r3"
    assert robot_words.listed(names) == "r1, r2, r3, r4, r5, r6, r7 and 13 more"


def test_the_page_of_an_unknown_robot_hears_so_without_an_error(pages_desk: PagesDesk) -> None:
    told = pages_desk.data("/robots/r9/words")
    assert told["known"] is False
    assert pages_desk.ask("/dashboard/data/robots/r9/view.png").status_code == 404
    assert pages_desk.ask("/dashboard/data/robots/R%20/words").status_code == 422


def test_the_page_of_a_robot_without_a_keyframe_asks_for_no_picture(pages_desk: PagesDesk) -> None:
    pages_desk.scene.send_pose("r4", pose())
    pages_desk.scene.settle()
    told = pages_desk.data("/robots/r4/words")
    assert told["known"]
    assert told["picture"]["key"] is None
    refused = pages_desk.ask("/dashboard/data/robots/r4/view.png")
    assert refused.status_code == 404
    assert refused.json()["detail"] == told["picture"]["words"]


def test_the_view_is_a_picture_of_the_cameras_shape(pages_desk: PagesDesk) -> None:
    pages_desk.scene.send("r1")
    pages_desk.scene.settle()
    told = pages_desk.data("/robots/r1/words")
    assert told["picture"]["key"] == "b0.0"
    answer = pages_desk.ask("/dashboard/data/robots/r1/view.png?keyframe=b0.0")
    assert answer.headers["content-type"] == "image/png"
    assert answer.headers["cache-control"] == "no-store"
    drawn = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert drawn is not None
    assert drawn.shape == (480, 640, 3)
