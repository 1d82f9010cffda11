"""While views are endless anybody may meet anybody: a robot is held against the nearest alone."""

import numpy as np
from covista_service.perception.surface import flat
from covista_service.station.events import SurveyPair, Tick
from covista_service.station.outlook import Outlook
from covista_service.station.pairs import pair_of

from tests.service.station.scenes import NOTHING, S, Scene, measured, pose
from tests.service.station.test_neighbourhoods import partners


def test_as_long_as_views_are_endless_a_crowd_costs_each_robot_no_more_than_its_nearest() -> None:
    scene = Scene.of(retry_after_s=1e6, capacity=1)
    for number in range(150):
        scene.send(f"r{number:03}", pose(0.1 * number))
        scene.tick()
    assert len(scene.snapshot.records) <= 32 * 150
    assert partners(scene.station, "r149") == {f"r{number:03}" for number in range(117, 149)}
    # Of old partners too: those that later ones have taken it for are not all among its own nearest.
    assert len(partners(scene.station, "r060")) == 64
    scene.send("r060", pose(6.0))
    scene.tick()
    assert partners(scene.station, "r060") == {f"r{number:03}" for number in (*range(44, 60), *range(61, 77))}
    hoods = scene.station._surveys.neighbourhoods
    for number in range(150):
        robot = scene.station._roster[f"r{number:03}"]
        hoods.deepen(robot, Outlook(robot.keyframe, robot.keyframe.pose, flat(0.25), 20, {}, (0.5, 0.5, 0.5)))
    # Those who were judged when nothing was known are judged again, some at a time.
    judged = [len(hoods.judge(scene.now_ns)) for _ in range(10)]
    assert max(judged[1:]) <= 16
    reaches = hoods._reaches
    assert not any(reach.endless for reach in reaches.values())
    for other in ("r000", "r060", "r149"):
        assert partners(scene.station, other) == {
            name for name in reaches if name != other and reaches[name].frustum.may_meet(reaches[other].frustum)
        }


def test_in_a_crowd_that_mixes_partners_are_the_nearest_of_now_and_those_that_images_have_found() -> None:
    scene, rng = Scene.of(retry_after_s=1e6, capacity=1), np.random.default_rng(2)
    for number in range(80):
        scene.send(f"r{number:02}", pose(10.0 * rng.random()))
        scene.tick()
    job = next(job for job in scene.told if isinstance(job, SurveyPair))
    found = pair_of(job.first.robot, job.second.robot)
    scene.done(job, measured())
    for turn in range(200):
        name = f"r{turn % 80:02}"
        scene.send(name, pose(10.0 * rng.random() + 1000 * (name in found) * (name == found[0])))
        # Whose keyframe is being surveyed uses the next one a little later.
        for _ in range(2):
            scene.receive(Tick())
            scene.now_ns += 3 * S
        if name not in found:
            assert len(partners(scene.station, name)) == 32
    assert found[1] in partners(scene.station, found[0])
    assert len(scene.snapshot.records) <= 32 * 80


def test_a_try_that_finds_nothing_makes_no_partners_of_two_that_are_not_near() -> None:
    scene = Scene.of(capacity=2, retry_after_s=0.0)
    for number in range(45):
        scene.send(f"r{number:02}", pose(0.1 * number))
        scene.settle(lambda job: NOTHING)
    assert scene.snapshot.workload.started["sweep"] > 0
    far = [(a, b) for a, b in scene.snapshot.records if int(b[1:]) - int(a[1:]) > 32]
    assert far == []
