"""Which pair is surveyed next: nobody starves, nothing is done twice, never more than there are hands."""

from collections import Counter
from itertools import combinations
from random import Random

import numpy as np
import pytest
from covista_service.perception.camera import Pose
from covista_service.station.events import BuildSurfaces, ExtractFeatures, SurveyPair, Tick
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.scenes import AHEAD, BACK, NOTHING, Scene, evaluated, measured, pose, surveys


def jobs(effects) -> list[SurveyPair]:
    return [effect for effect in effects if isinstance(effect, SurveyPair)]


def test_every_pair_is_surveyed_once_per_keyframe() -> None:
    scene = Scene()
    robots = [f"r{number}" for number in range(6)]
    for number, robot in enumerate(robots):
        scene.send(robot, pose(0.1 * number))
    assert sorted(surveys(scene.settle())) == list(combinations(robots, 2))
    assert surveys(scene.settle()) == []
    scene.send("r3", pose(0.3))
    assert sorted(surveys(scene.settle())) == sorted(tuple(sorted(("r3", other))) for other in robots if other != "r3")


@given(capacity=st.integers(1, 5), robots=st.integers(2, 6))
@settings(max_examples=15, deadline=None)
def test_there_are_never_more_surveys_under_way_than_hands(capacity: int, robots: int) -> None:
    scene = Scene.of(capacity=capacity)
    under_way: list[SurveyPair] = []
    for turn in range(20):
        scene.send(f"r{turn % robots}", pose(0.1 * turn))
        under_way += jobs(scene.tick())
        assert len(under_way) <= capacity
        pairs = [(job.first.robot, job.second.robot) for job in under_way]
        assert len(set(pairs)) == len(pairs)
        if under_way and turn % 2:
            done = under_way.pop(0)
            scene.done(done, measured())


@given(capacity=st.integers(1, 4), seed=st.integers(0, 99))
@settings(max_examples=15, deadline=None)
def test_there_are_never_more_surveys_and_surfaces_under_way_than_hands(capacity: int, seed: int) -> None:
    scene, chance = Scene.of(capacity=capacity), Random(seed)
    under_way: list[SurveyPair | BuildSurfaces] = []
    built = 0
    for turn in range(60):
        scene.send(f"r{turn % 5}", pose(0.1 * turn))
        scene.now_ns += chance.randrange(400_000_000)
        under_way += [effect for effect in scene.receive(Tick()) if isinstance(effect, SurveyPair | BuildSurfaces)]
        assert len(under_way) <= capacity
        for _ in range(chance.randrange(len(under_way) + 1)):
            job = under_way.pop(chance.randrange(len(under_way)))
            if isinstance(job, SurveyPair):
                scene.done(job, measured())
            else:
                built += 1
                scene.receive(scene.wall_ahead(job))
    assert built > 5


def test_a_survey_under_way_does_not_hold_up_other_pairs() -> None:
    scene = Scene.of(capacity=2)
    for robot in ("r1", "r2", "r3", "r4"):
        scene.send(robot)
    stuck, *rest = jobs(scene.tick())
    told = scene.work(rest)
    done = {(job.first.robot, job.second.robot) for job in jobs(told)}
    assert len(done) == 5
    assert (stuck.first.robot, stuck.second.robot) not in done


def test_the_newest_keyframe_is_surveyed_and_the_ones_between_are_not() -> None:
    scene = Scene.of(capacity=1)
    scene.send("r1")
    scene.send("r2")
    (job,) = jobs(scene.tick())
    for _ in range(3):
        scene.send("r1")
    assert jobs(scene.tick()) == []
    later = jobs(scene.work([job]))
    assert [(job.first.sequence, job.second.sequence) for job in later] == [(0, 0), (3, 0)]


def overload(seconds: int, rates: dict[str, int], surveys_per_s: int) -> tuple[Counter, Counter]:
    """Surveys by robot and by pair while robots send so many keyframes in a second, more than can be surveyed."""
    scene = Scene.of(capacity=1)
    by_robot: Counter = Counter()
    by_pair: Counter = Counter()
    step_s, under_way = 1 / surveys_per_s, []
    for step in range(seconds * surveys_per_s):
        for number, (robot, rate) in enumerate(sorted(rates.items())):
            due = (step + 1) * rate // surveys_per_s - step * rate // surveys_per_s
            for _ in range(due):
                scene.send(robot, pose(0.1 * number))
        for job in under_way:
            scene.done(job, measured())
        under_way = jobs(scene.wait(step_s))
        for job in under_way:
            pair = (job.first.robot, job.second.robot)
            by_pair[pair] += 1
            by_robot.update(pair)
    return by_robot, by_pair


def test_a_robot_that_floods_starves_nobody() -> None:
    robots = {f"r{number}": 1 for number in range(6)}
    rates = robots | {"r0": 50}
    by_robot, by_pair = overload(20, rates, 20)
    assert len(by_pair) == 15
    others = [count for pair, count in by_pair.items() if "r0" not in pair]
    # 400 surveys; fair shares of 15 pairs were 26 each. The flood may take the half that goes to news.
    assert min(others) >= 10
    assert max(others) <= 3 * min(others)
    assert min(by_robot.values()) >= 400 / 15


def test_equals_get_equal_shares() -> None:
    _, by_pair = overload(20, {f"r{number}": 2 for number in range(5)}, 10)
    assert len(by_pair) == 10
    assert max(by_pair.values()) <= 2 * min(by_pair.values())


def test_a_new_keyframe_is_seen_before_old_pairs_are_seen_again() -> None:
    scene = Scene.of(capacity=1)
    robots = [f"r{number}" for number in range(8)]
    for number, robot in enumerate(robots):
        scene.send(robot, pose(0.1 * number))
    effects = scene.tick()
    scene.send("r7", pose(0.7))
    keyframe = scene.snapshot.robots["r7"].keyframe
    done = 0
    while not any(name == keyframe for name, _ in evaluated(effects)):
        (job,) = jobs(effects)
        effects = [*scene.done(job, measured()), *scene.tick()]
        done += 1
    assert done <= 8


def test_the_first_look_of_a_new_keyframe_goes_to_who_shared_most_with_it() -> None:
    scene = Scene.of(capacity=1)
    for robot in ("r1", "r2", "r3", "r4"):
        scene.send(robot)
    shared = {("r1", "r3"): 0.9}
    scene.settle(lambda job: measured(*(2 * [shared.get((job.first.robot, job.second.robot), 0.2)])))
    order = []
    for _ in range(2):
        scene.send("r1")
        order.append(surveys(scene.settle())[0])
    assert ("r1", "r3") in order


def test_views_that_cannot_meet_are_tried_once_in_a_while_all_the_same() -> None:
    scene = Scene.of(retry_after_s=30)
    scene.send("a", pose(0, AHEAD))
    scene.send("b", pose(1, AHEAD))
    scene.settle()
    scene.send("y", pose(0, BACK))
    scene.send("z", pose(1, BACK))
    scene.settle(lambda job: measured() if job.first.robot == "y" else NOTHING)
    alike = {("a", "b"), ("y", "z")}
    tried: Counter = Counter()
    for second in range(120):
        for robot, where in (("a", AHEAD), ("b", AHEAD), ("y", BACK), ("z", BACK)):
            scene.send(robot, pose(0.001 * second, where))
        effects = scene.wait(1)
        told = scene.work(effects, lambda job: measured() if (job.first.robot, job.second.robot) in alike else NOTHING)
        tried.update(surveys(told))
    assert tried["a", "b"] == tried["y", "z"] == 120
    assert all(3 <= tried[pair] <= 5 for pair in combinations("abyz", 2) if pair not in alike)


def test_what_was_seen_in_common_is_looked_at_again_when_views_part() -> None:
    scene = Scene()
    scene.send("r1", pose(0, AHEAD))
    scene.send("r2", pose(1, AHEAD))
    scene.settle()
    scene.send("r2", pose(1, BACK))
    assert surveys(scene.settle(lambda job: NOTHING)) == [("r1", "r2")]
    assert scene.snapshot.pair("r1", "r2").overlap_a == 0.0
    scene.send("r2", pose(1, BACK))
    assert surveys(scene.settle()) == []


def test_images_outrank_poses_that_say_that_views_cannot_meet() -> None:
    scene = Scene.of(retry_after_s=0.0)
    scene.send("r1", pose(0, AHEAD))
    scene.send("r2", pose(1, AHEAD))
    scene.settle()
    scene.send("r3", pose(0, BACK))
    scene.settle(lambda job: measured(0.4, 0.5))
    for _ in range(20):
        scene.settle(lambda job: measured(0.4, 0.5))
    view = scene.snapshot.pair("r1", "r3")
    assert (view.outcome, view.overlap_a, view.overlap_b) == ("measured", 0.4, 0.5)


def test_a_keyframe_whose_surface_was_carried_over_has_not_been_surveyed() -> None:
    scene = Scene.of(capacity=1)
    scene.send("r1")
    scene.send("r2")
    scene.settle()
    scene.send("r1")
    (job,) = jobs(scene.tick())
    scene.send("r1")
    # So late is the worker that the next one waits no longer.
    scene.wait(3)
    newest = scene.snapshot.robots["r1"].keyframe
    told = evaluated([*scene.done(job, measured()), *scene.tick()])
    assert newest not in [name for name, _ in told]


def test_the_first_survey_of_a_keyframe_is_told_once_with_its_arrival() -> None:
    scene = Scene()
    for robot in ("r1", "r2", "r3"):
        scene.send(robot)
    told = evaluated(scene.settle())
    assert sorted(name.robot for name, _ in told) == ["r1", "r2", "r3"]
    assert {arrived_ns for _, arrived_ns in told} == {scene.now_ns}
    scene.wait(1)
    scene.send("r1")
    assert [name.robot for name, _ in evaluated(scene.settle(lambda job: NOTHING))] == ["r1"]


def test_surveys_whose_keyframe_is_replaced_before_they_begin_are_counted_and_never_begun() -> None:
    scene = Scene.of(capacity=1)
    for robot in ("r1", "r2", "r3"):
        scene.send(robot)
    (job,) = jobs(scene.tick())
    assert (job.first.robot, job.second.robot) == ("r1", "r2")
    waiting = scene.snapshot.workload.waiting
    assert (waiting["fresh"], waiting["regular"]) == (1, 2)
    scene.send("r3")
    scene.tick()
    # r1 with r3, and r2 with r3.
    assert scene.snapshot.workload.outdated == 2
    later = jobs(scene.work([job]))
    assert {name.sequence for job in later[1:] for name in (job.first, job.second) if name.robot == "r3"} == {1}
    assert scene.snapshot.workload.outdated == 2


def test_what_was_started_is_counted_by_queue_and_what_waits_goes_to_nothing() -> None:
    scene = Scene.of(capacity=2)
    for number in range(5):
        scene.send(f"r{number}", pose(0.1 * number))
    told = scene.settle()
    scene.send("r0", pose(0.4))
    told += scene.settle()
    load = scene.snapshot.workload
    assert load.waiting == {"fresh": 0, "regular": 0, "moved": 0}
    assert sum(load.started.values()) == len(jobs(told))
    assert load.started["moved"] == 1
    assert load.under_way == 0


def test_hands_may_come_and_go_while_the_station_runs() -> None:
    scene = Scene.of(capacity=1)
    for number in range(6):
        scene.send(f"r{number}", pose(0.1 * number))
    under_way = jobs(scene.tick())
    assert len(under_way) == 1
    scene.station.resize(4)
    under_way += jobs(scene.tick())
    assert len(under_way) == scene.snapshot.workload.under_way == 4
    scene.station.resize(2)
    for expected in (3, 2, 2):
        scene.done(under_way.pop(0), NOTHING)
        under_way += jobs(scene.tick())
        assert len(under_way) == expected
    with pytest.raises(ValueError, match="at least one"):
        scene.station.resize(0)
    assert scene.station.options.capacity == 2


def test_more_hands_extract_more_at_once() -> None:
    scene = Scene.of(capacity=1)
    for robot in ("r1", "r2", "r3"):
        scene.send(robot, image=True)
    scene.station.resize(3)
    assert len([effect for effect in scene.tick() if isinstance(effect, ExtractFeatures)]) == 2


def test_pairs_whose_views_have_changed_more_are_surveyed_first() -> None:
    scene = Scene.of(capacity=1, retry_after_s=1e6)
    robots = [f"r{number}" for number in range(6)]
    for robot in robots:
        scene.send(robot)
    scene.settle()
    scene.wait(1)
    scene.send("r1", pose(0.0))
    scene.send("r4", pose(1.5))
    order = [pair for pair in surveys(scene.settle()) if pair != ("r1", "r4")]
    ranks = {name: [rank for rank, pair in enumerate(order) if name in pair] for name in ("r1", "r4")}
    assert [len(ranks[name]) for name in ("r1", "r4")] == [4, 4]
    assert sum(ranks["r4"]) < sum(ranks["r1"])


def test_a_keyframe_whose_partner_is_busy_waits_for_it_and_holds_up_nobody() -> None:
    scene = Scene.of(capacity=3)
    scene.send("r1")
    scene.send("r2")
    (job,) = jobs(scene.tick())
    scene.send("r1")
    assert jobs(scene.wait(3)) == []
    assert scene.snapshot.workload.waiting["fresh"] == 1
    later = jobs(scene.work([job]))
    assert [(job.first.sequence, job.second.sequence) for job in later[1:2]] == [(1, 0)]
    assert scene.snapshot.workload.waiting["fresh"] == 0


def test_under_overload_every_queue_has_its_turns() -> None:
    """Twelve robots that drive in two places, out of sight of each other, with hands for few of them."""
    scene, under_way = Scene.of(capacity=1, retry_after_s=1.0), []
    for step in range(160):
        for number in range(step % 4, 12, 4):
            scene.send(f"r{number:02}", pose(0.5 * (step // 4 % 6), BACK if number % 2 else AHEAD))
        for job in under_way:
            alike = int(job.first.robot[1:]) % 2 == int(job.second.robot[1:]) % 2
            scene.done(job, measured() if alike else NOTHING)
        under_way = jobs(scene.wait(0.25))
    started = scene.snapshot.workload.started
    assert sum(started.values()) >= 100
    assert started["regular"] >= 0.2 * sum(started.values())
    assert min(started[queue] for queue in ("fresh", "moved", "sweep")) >= 0.08 * sum(started.values())


def test_pairs_at_the_boundary_of_groups_are_surveyed_before_others() -> None:
    """a1 and a2 are as good as one, b1 has something in common with both, and the far ones with nobody else."""
    seen = {("a1", "a2"): 1.0, ("a1", "b1"): 0.5, ("a2", "b1"): 0.5, ("c1", "c2"): 1.0}
    scene = Scene.of(capacity=1, retry_after_s=1e6)
    places = {"a1": 0.0, "a2": 0.1, "b1": 0.9, "c1": 40.0, "c2": 40.1}
    for robot, x_m in places.items():
        scene.send(robot, pose(x_m))
    scene.settle(lambda job: measured(*2 * [seen.get((job.first.robot, job.second.robot), 0.0)]))
    boundary = scene.station._groups.boundary
    assert boundary(("a1", "b1")) > max(boundary(("a1", "a2")), boundary(("a1", "c1")), boundary(("c1", "c2")))
    assert all(0 <= boundary(pair) <= 1 for pair in combinations(sorted(places), 2))
    assert boundary(("a1", "nobody")) == 0.0


def test_the_hands_of_a_robot_that_is_forgotten_are_full_until_they_are_back() -> None:
    scene = Scene.of(capacity=2, forget_after_s=1.0, live_after_s=0.5, gone_after_s=0.1)
    under_way: list[SurveyPair] = []
    for turn in range(30):
        # All are forgotten before any survey is done; one comes back of a worker now and then, or has failed.
        for robot in ("r1", "r2", "r3"):
            scene.send(robot, sequence=turn)
        under_way += jobs(scene.tick())
        assert len(under_way) == scene.snapshot.workload.under_way <= 2
        under_way += jobs(scene.wait(1.5))
        assert scene.snapshot.robots == {}
        assert len(under_way) == scene.snapshot.workload.under_way == 2
        if turn % 3 == 2:
            scene.done(under_way.pop(0), measured() if turn % 2 else None)
            assert scene.snapshot.workload.under_way == 1
    assert sum(scene.snapshot.workload.started.values()) == 11


def test_who_has_no_partners_waits_for_nothing() -> None:
    scene = Scene.of(retry_after_s=1e6)
    scene.send("r1", pose(0, AHEAD))
    scene.send("r2", Pose(BACK, np.array([0.0, 0.0, -50.0])))
    scene.settle(lambda job: NOTHING)
    scene.send("r1", pose(0, AHEAD))
    scene.settle(lambda job: NOTHING)
    assert scene.station._surveys._agenda._parked == {"r1"}
    assert scene.snapshot.workload.waiting == {"fresh": 0, "regular": 0, "moved": 0}
