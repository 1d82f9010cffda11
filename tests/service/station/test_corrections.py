"""How far reported poses are off, and who is flagged for it."""

import numpy as np
import pytest
from covista_service.perception.camera import Pose
from covista_service.perception.surface import flat
from covista_service.station.corrections import Corrections
from covista_service.station.outlook import Outlook

from tests.service.perception.scenes import turn
from tests.service.station.scenes import Scene, pose


def outlook(scene: Scene, deg: float = 0.0, m: float = 0.0) -> Outlook:
    keyframe = scene.keyframe("r1", pose(1.0))
    stands = Pose(
        turn(0, np.radians(deg), 0) @ keyframe.pose.world_from_camera, keyframe.pose.centre_m + np.array([0, m, 0])
    )
    return Outlook(keyframe, stands, flat(0.25), 40, {}, (4.0, 4.0, 4.0))


def texts(corrections: Corrections, outlooks: list[Outlook], again: bool = False) -> list[str]:
    return [event.text for one in outlooks for event in corrections.note(one, 0, again=again)]


@pytest.mark.parametrize(("deg", "m"), [(0.0, 0.0), (3.0, 0.0), (0.0, 0.3), (179.0, 2.0)])
def test_a_correction_says_degrees_and_metres(deg: float, m: float) -> None:
    corrections = Corrections()
    corrections.note(outlook(Scene(), deg, m), 0, again=False)
    found = corrections["r1"]
    assert found is not None
    assert (found.deg, found.m) == (pytest.approx(deg, abs=1e-6), pytest.approx(m))


def test_a_robot_that_keeps_disagreeing_is_flagged_once_until_it_agrees_again() -> None:
    corrections, scene = Corrections(), Scene()
    off, right = [outlook(scene, 3.0, 0.2) for _ in range(6)], [outlook(scene) for _ in range(6)]
    assert texts(corrections, off) == [
        "the poses that r1 reports keep disagreeing with the images: 3.0 deg, 0.20 m off"
    ]
    assert texts(corrections, right) == ["the poses that r1 reports agree with the images again"]
    assert texts(corrections, [off[0], right[0], off[1], off[2]]) == []


def test_news_of_the_same_keyframe_are_one_disagreement() -> None:
    corrections, scene = Corrections(), Scene()
    one = outlook(scene, 3.0)
    assert texts(corrections, [one]) + texts(corrections, 5 * [one], again=True) == []


def test_a_forgotten_robot_is_not_known() -> None:
    corrections = Corrections()
    corrections.note(outlook(Scene()), 0, again=False)
    corrections.forget("r1")
    assert corrections["r1"] is None
