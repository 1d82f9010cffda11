"""Who bears out whom, and which depths have one scale."""

import numpy as np
import pytest
from covista_service.perception.camera import Pose
from covista_service.perception.surface import flat
from covista_service.perception.visibility import SAME_SCALE
from covista_service.station.agreements import Agreements
from covista_service.station.events import KeyframeId
from covista_service.station.outlooks import Outlook, Scales

from tests.service.station.scenes import Scene, pose


def agreements(agree: str = "", contradict: str = "") -> Agreements:
    found = Agreements()
    for pairs, said in ((agree, True), (contradict, False)):
        for one, other in pairs.split():
            found.note(KeyframeId(one, "b", 0), KeyframeId(other, "b", 0), agree=said)
    return found


@pytest.mark.parametrize(
    ("agree", "contradict", "borne_out"),
    [
        ("", "", ""),
        ("ab", "", "ab"),
        ("ab bc", "ad bd", "abc"),
        ("ab", "ac", "ab"),
        # One word against another: nobody can say who is wrong.
        ("", "ab", ""),
        ("ab cd", "ac", ""),
    ],
)
def test_the_largest_set_that_agrees_is_borne_out(agree: str, contradict: str, borne_out: str) -> None:
    assert agreements(agree, contradict).borne_out(lambda name: True) == set(borne_out)


def test_what_was_said_last_counts_and_a_forgotten_robot_does_not() -> None:
    found = agreements("ab bc", "ad")
    found.note(KeyframeId("b", "b", 1), KeyframeId("c", "b", 0), agree=False)
    assert found.borne_out(lambda name: True) == {"a", "b"}
    found.forget("a")
    assert found.borne_out(lambda name: True) == set()


def test_who_agreed_with_a_keyframe_that_is_gone_is_not_borne_out_by_that() -> None:
    found = agreements("ab bc ad", "")
    found.note(KeyframeId("b", "b", 0), KeyframeId("d", "b", 7), agree=False)
    assert found.borne_out(lambda name: name != KeyframeId("d", "b", 0)) == {"a", "b", "c"}


def outlooks(*centres_m: float) -> list[Outlook]:
    scene = Scene()
    keyframes = [scene.keyframe(f"r{k}", pose(x_m)) for k, x_m in enumerate(centres_m)]
    return [Outlook(one, Pose(np.eye(3), one.pose.centre_m), flat(0.25), 20, {}, (4.0, 4.0, 4.0)) for one in keyframes]


def test_robots_that_matches_connect_have_one_scale_and_others_theirs() -> None:
    scales = Scales(outlooks(0.0, 1.0, 2.0, 5.0, 9.0), [(0, 1), (1, 2), (3, 4)])
    assert scales.ratios("r0", "r2") == SAME_SCALE
    least, most = scales.ratios("r0", "r3")
    assert least == pytest.approx(1 / most)
    # Scales by baselines of metres at a depth of four: known to a few per cent.
    assert 1.05 < most < 1.6


def test_a_robot_alone_has_no_scale_but_that_of_its_own_past() -> None:
    """Nothing tells its own; what it has seen before and how it moved bounds it, or walls would be taken for scales."""
    scales = Scales(outlooks(0.0, 1.0, 2.0), [(0, 1)])
    least, most = scales.ratios("r2", "r0")
    assert 1.5 < most < 2
    assert least == pytest.approx(1 / most)
