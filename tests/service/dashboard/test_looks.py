from base64 import b64decode

import cv2
import numpy as np
import pytest
from covista_service.answers import NotKnownError, pair_picture
from covista_service.dashboard.looks import Looks

from tests.service.answers.test_answers import FIRST, SECOND, both_see_the_wall
from tests.service.station.scenes import Scene


def two_at_a_wall() -> Scene:
    scene = Scene()
    scene.send("r1", FIRST)
    scene.send("r2", SECOND)
    scene.settle(both_see_the_wall)
    return scene


@pytest.fixture
def scene() -> Scene:
    return two_at_a_wall()


def test_a_look_has_report_planes_and_both_pictures_of_one_moment(scene: Scene) -> None:
    looks = Looks()
    drawn = looks.drawn(looks.best(scene.snapshot, "r2", "r1"), "r2")
    assert drawn["explained"]
    assert (drawn["pair"]["a"], drawn["pair"]["overlap_a"]) == ("r2", 0.75)
    assert [plane["support"] for plane in drawn["pair"]["planes"]] == [40]
    for picture, robot in zip(drawn["pictures"], ("r2", "r1"), strict=True):
        png = b64decode(picture["png"])
        assert png == pair_picture(scene.snapshot.pair("r1", "r2"), robot)
        assert cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR) is not None


def test_planes_that_the_next_keyframe_has_not_yet_are_still_shown(scene: Scene) -> None:
    looks = Looks()
    told = looks.best(scene.snapshot, "r1", "r2")
    scene.send("r1", FIRST)
    scene.wait(1)
    assert not scene.snapshot.pair("r1", "r2").explained
    assert looks.best(scene.snapshot, "r1", "r2") is told
    assert looks.note(scene.snapshot, "r1", "r2").version != told.version


def test_what_is_long_ago_gives_way_to_what_is(scene: Scene) -> None:
    looks = Looks()
    told = looks.best(scene.snapshot, "r1", "r2")
    scene.send("r1", FIRST)
    scene.wait(31)
    assert looks.best(scene.snapshot, "r1", "r2").version != told.version


def test_a_version_stays_while_there_is_nothing_new_to_see(scene: Scene) -> None:
    looks = Looks()
    before = looks.note(scene.snapshot, "r1", "r2").version
    scene.wait(1)
    assert looks.note(scene.snapshot, "r1", "r2").version == before


def test_who_has_no_keyframe_has_a_word_instead_of_a_picture(scene: Scene) -> None:
    scene.send_pose("r3", FIRST)
    scene.settle(both_see_the_wall)
    looks = Looks()
    drawn = looks.drawn(looks.best(scene.snapshot, "r1", "r3"), "r1")
    assert not drawn["explained"]
    assert [picture["png"] for picture in drawn["pictures"]] == [None, None]
    assert all("not known yet" in picture["problem"] for picture in drawn["pictures"])


def test_who_is_not_known_makes_no_pair(scene: Scene) -> None:
    with pytest.raises(NotKnownError, match="r9"):
        Looks().best(scene.snapshot, "r1", "r9")


def test_only_so_many_pairs_and_pictures_are_kept() -> None:
    scene = Scene()
    for number in range(9):
        scene.send(f"r{number}", FIRST)
    scene.settle(both_see_the_wall)
    snapshot, looks = scene.snapshot, Looks()
    for pair in sorted(snapshot.records):
        looks.best(snapshot, *pair)
    assert len(looks._told) == 32 < len(snapshot.records)
    for other in ("r1", "r2", "r3", "r4", "r5"):
        assert looks.drawn(looks.best(snapshot, "r0", other), "r0")["pair"]["b"] == other
    assert len(looks._drawn) == 4
