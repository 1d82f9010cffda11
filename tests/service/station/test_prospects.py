"""What a keyframe can see, as far as is known: held against others as long as it is in use."""

import numpy as np
from covista_service.perception.camera import Pose
from covista_service.perception.surface import flat
from covista_service.station.events import Keyframe
from covista_service.station.outlook import Outlook
from covista_service.station.reach import Reach, depth_of

from tests.service.station.scenes import AHEAD, BACK, NOTHING, Scene, measured, pose, surveys


def outlook(keyframe: Keyframe, points: int = 20) -> Outlook:
    return Outlook(keyframe, keyframe.pose, flat(1 / 4.0), points, {}, (4.0, 4.0, 4.0))


FAR_AHEAD = Pose(AHEAD, np.array([0.0, 0.0, 50.0]))


def test_a_view_reaches_to_infinity_until_its_depth_is_known() -> None:
    scene = Scene()
    here, there = scene.keyframe("r1", pose()), Reach.of(scene.keyframe("r2", FAR_AHEAD), None)
    depth = depth_of(outlook(here))
    assert Reach.of(here, None).frustum.may_meet(there.frustum)
    assert not Reach.of(here, depth).frustum.may_meet(there.frustum)


def test_a_reach_is_outdated_by_a_new_keyframe_and_by_a_new_depth() -> None:
    scene = Scene()
    old, new = scene.keyframe("r1"), scene.keyframe("r1")
    depth = depth_of(outlook(old))
    reach = Reach.of(old, depth)
    assert reach.is_of(old, depth)
    assert not reach.is_of(new, depth)
    assert not reach.is_of(old, None)


def test_a_robot_that_turns_away_and_back_is_judged_by_where_it_looks_now() -> None:
    scene = Scene.of(retry_after_s=1e6)
    scene.send("r1", pose(0))
    scene.send("r2", pose(1), sequence=0)
    scene.settle(lambda job: NOTHING)
    scene.send("r2", Pose(BACK, np.array([0.0, 0.0, -1.0])), sequence=1)
    assert surveys(scene.settle(lambda job: NOTHING)) == []
    scene.send("r2", pose(1), sequence=2)
    assert surveys(scene.settle(lambda job: measured())) == [("r1", "r2")]
