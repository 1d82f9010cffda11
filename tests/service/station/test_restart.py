"""A station that starts again goes on where the one before has ended."""

import pytest
from covista_schemas.reports import FoundBy, Status
from covista_service.perception.camera import Pose
from covista_service.station.events import BuildSurfaces, Effect, GroupsChanged, PoseArrived, SurveyPair, TokenSeen
from covista_service.station.ledger import Counts
from covista_service.station.memory import Memory
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.station.memories import plain
from tests.service.station.remembering import remember
from tests.service.station.scenes import BACK, NOTHING, S, Scene, happenings, measured, pose, surveys
from tests.service.station.test_groups import changes, groups, share, two_groups
from tests.service.station.test_laws import Life, assert_agreement

ROBOTS = ("a1", "a2", "a3", "b1", "b2", "b3")


def place(robot: str) -> Pose:
    return pose((20 if robot[0] == "b" else 0) + 0.1 * int(robot[1]) - 0.1)


def hear(scene: Scene, robots: tuple[str, ...] = ROBOTS) -> list[Effect]:
    """Let robots send from where they are, and all be done that follows from it."""
    told = [effect for robot in robots for effect in scene.send(robot, place(robot))]
    return told + scene.settle(share)


def test_groups_stand_at_once_under_a_number_of_their_own_and_nothing_has_happened() -> None:
    before = two_groups()
    after = before.restarted(2)
    assert groups(after) == groups(before)
    view = after.snapshot
    assert view.groups.revision == before.snapshot.groups.revision + 1
    assert view.groups.time_ns == after.now_ns
    assert {name: robot.group for name, robot in view.robots.items()} == {
        name: robot.group for name, robot in before.snapshot.robots.items()
    }
    effects = after.tick()
    assert happenings(effects) == []
    (change,) = changes(effects)
    assert (change.revision, change.robots) == (view.groups.revision, ROBOTS)
    assert changes(after.wait(1)) == []
    assert after.snapshot.groups.revision == view.groups.revision


def test_robots_are_where_they_were_and_their_accounts_begin_anew() -> None:
    before = two_groups()
    before.send_pose("a1", pose(0.01))
    before.tick()
    after = before.restarted(1)
    was, now = before.snapshot.robots["a1"], after.snapshot.robots["a1"]
    assert (now.boot, now.keyframe, now.camera, now.last_seen_ns) == (
        was.boot,
        was.keyframe,
        was.camera,
        was.last_seen_ns,
    )
    assert now.fix is not None
    assert was.fix is not None
    assert (now.fix.pose, now.fix.time_ns) == (was.fix.pose, was.fix.time_ns)
    assert (now.keyframes, now.poses) == (Counts(), Counts())
    assert after.station.census().keyframes == 0
    hear(after, ("a1",))
    # As of any robot that sent before the station heard of it.
    assert after.snapshot.robots["a1"].keyframes == Counts(received=1, used=1, missing=1)


@pytest.mark.parametrize(("down_s", "status"), [(1, Status.LIVE), (10, Status.STALE), (300, Status.STALE)])
def test_presence_is_by_the_last_sign_of_life_and_who_stood_in_a_group_is_awaited(down_s: int, status: Status) -> None:
    after = two_groups().restarted(down_s)
    assert happenings(after.tick()) == []
    assert {view.status for view in after.snapshot.robots.values()} == {status}
    told = happenings(hear(after))
    assert told == [] if status is Status.LIVE else {("status", f"{robot} is live") for robot in ROBOTS} == set(told)
    assert len(groups(after)) == 2


def test_who_does_not_come_back_is_gone_once_the_station_has_listened_for_as_long_as_it_takes_to_be_stale() -> None:
    after = two_groups().restarted(300)
    assert ("status", "a1 is gone") not in happenings(hear(after, ROBOTS[1:]))
    told = happenings(after.wait(5))
    assert ("status", "a1 is gone") in told
    assert ("leave", "a1 left g1") in told or ("leave", "a1 left g2") in told


def test_who_was_gone_stays_gone() -> None:
    before = two_groups()
    before.wait(30)
    hear(before, ROBOTS[1:])
    before.wait(6)
    assert before.snapshot.robots["a1"].status is Status.GONE
    after = before.restarted(1)
    assert after.snapshot.robots["a1"].status is Status.GONE
    assert after.snapshot.groups.ungrouped == (("a1", "gone"),)
    assert happenings(after.tick()) == []
    label = after.snapshot.robots["a2"].group
    told = happenings(hear(after, ("a1",)))
    assert ("join", f"a1 joined {label}") in told


def test_who_is_silent_for_too_long_is_forgotten_and_said_to_be() -> None:
    after = two_groups().restarted(600)
    told = happenings(after.tick())
    assert {text for kind, text in told if kind == "status"} == {f"{robot} is forgotten" for robot in ROBOTS}
    assert after.snapshot.robots == {}
    assert after.snapshot.records == {}
    assert groups(after) == {}


def test_a_robot_with_a_token_was_alive_to_the_last() -> None:
    before = two_groups()
    before.receive(TokenSeen("a1", "b0"))
    before.wait(3000)
    assert list(before.snapshot.robots) == ["a1"]
    after = before.restarted(1)
    assert after.snapshot.robots["a1"].status is Status.LIVE
    after.tick()
    assert after.snapshot.robots["a1"].last_seen_ns == before.now_ns


def test_pairs_answer_with_what_they_had_in_common_until_that_is_too_old() -> None:
    before = two_groups()
    after = before.restarted(10)
    was, now = before.snapshot.pair("a1", "a2"), after.snapshot.pair("a1", "a2")
    assert (now.overlap_a, now.overlap_b, now.found_by, now.age_s) == (
        was.overlap_a,
        was.overlap_b,
        FoundBy.DECAYED,
        10,
    )
    assert now.keyframe_a is not None
    assert was.keyframe_a is not None
    assert now.keyframe_a.id == was.keyframe_a.id
    assert now.intervals == was.intervals
    assert now.outlooks is None
    for robot in ROBOTS:
        after.receive(TokenSeen(robot, "b0"))
    after.wait(589.9)
    assert after.snapshot.pair("a1", "a2").found_by is FoundBy.DECAYED
    after.wait(0.1)
    assert after.snapshot.pair("a1", "a2").found_by is FoundBy.UNKNOWN


def test_robots_whose_views_cannot_meet_share_nothing_after_a_restart_too() -> None:
    before = Scene.of()
    before.send("r1", pose(0))
    before.send("r2", pose(1, BACK))
    before.send("r3", pose(0.1))
    before.settle(lambda job: NOTHING if "r2" in (job.first.robot, job.second.robot) else measured())
    assert ("r1", "r2") not in before.snapshot.records
    after = before.restarted(1)
    after.tick()
    view = after.snapshot.pair("r1", "r2")
    assert (view.overlap_a, view.overlap_b, view.found_by, view.age_s) == (0.0, 0.0, FoundBy.DECAYED, 1)
    similarity = after.snapshot.similarity
    assert similarity.overlap[similarity.robots.index("r1"), similarity.robots.index("r2")] == 0.0


def test_pairs_that_nothing_was_known_of_are_unknown() -> None:
    before = Scene.of()
    before.send("r1", pose(0))
    before.send("r2", pose(0.1))
    before.tick()
    assert before.snapshot.pair("r1", "r2").found_by is FoundBy.UNKNOWN
    after = before.restarted(1)
    after.tick()
    assert after.snapshot.pair("r1", "r2").found_by is FoundBy.UNKNOWN


def test_nothing_remembered_is_surveyed_until_both_have_sent_a_keyframe() -> None:
    after = two_groups().restarted(1)
    assert [effect for effect in after.wait(60) if isinstance(effect, SurveyPair | BuildSurfaces)] == []
    after.send_pose("a2", pose(0.1))
    assert surveys(hear(after, ("a1",))) == []
    assert after.snapshot.pair("a1", "a2").found_by is FoundBy.DECAYED
    assert ("a1", "a2") in surveys(hear(after, ("a2",)))
    view = after.snapshot.pair("a1", "a2")
    assert (view.found_by, view.age_s) == (FoundBy.IMAGE, 0)
    assert after.snapshot.pair("a1", "a3").found_by is FoundBy.DECAYED


def test_groups_do_not_flicker_while_robots_come_back_one_by_one() -> None:
    before = two_groups()
    after, told = before.restarted(3), []
    told += after.tick()
    for _ in range(4):
        for robot in ROBOTS:
            told += hear(after, (robot,))
            told += after.wait(0.3)
    assert len(changes(told)) == 1
    assert {text for _, text in happenings(told)} <= {f"{robot} is live" for robot in ROBOTS}
    assert groups(after) == groups(before)


def test_what_was_seen_in_common_is_looked_at_again_even_if_poses_say_that_views_cannot_meet() -> None:
    before = two_groups()
    after = before.restarted(1)
    hear(after, ("a1",))
    after.send("a2", pose(5, BACK))
    assert ("a1", "a2") in surveys(after.settle(share))


def test_a_new_label_has_a_number_that_was_never_used() -> None:
    before = two_groups()
    before.wait(700)
    assert groups(before) == {}
    last = before.snapshot.groups.last_label
    assert last >= 2
    after = before.restarted(1)
    hear(after, ("a1",))
    assert set(groups(after)) == {f"g{last + 1}"}


def test_numbers_that_may_have_been_used_are_not_used_again() -> None:
    scene = Scene(memory=Memory(revision=1000, label=77))
    assert scene.snapshot.groups.revision == 1001
    (change,) = changes(scene.tick())
    assert (change.revision, change.robots) == (1001, ())
    hear(scene, ("a1",))
    assert groups(scene) == {"g78": ("a1",)}
    assert scene.snapshot.groups.revision == 1002


def test_an_empty_memory_is_none() -> None:
    scene, fresh = Scene(memory=Memory()), Scene()
    for each in (scene, fresh):
        assert each.tick() == []
        hear(each)
    assert groups(scene) == groups(fresh)
    assert scene.snapshot.groups.revision == fresh.snapshot.groups.revision
    with pytest.raises(ValueError, match="already"):
        scene.station.restore(Memory(), scene.now_ns)


def test_a_clock_that_was_set_back_meanwhile_makes_nothing_younger_than_now() -> None:
    before = two_groups()
    after = before.restarted(-3600)
    after.tick()
    view = after.snapshot
    assert {robot.status for robot in view.robots.values()} == {Status.LIVE}
    assert {robot.last_seen_ns for robot in view.robots.values()} == {after.now_ns}
    assert view.pair("a1", "a2").age_s == 0
    after.wait(5)
    assert {robot.status for robot in after.snapshot.robots.values()} == {Status.STALE}


def test_the_station_that_is_remembered_may_have_been_ahead_of_the_wall() -> None:
    before = two_groups()
    before.wait(-3600)
    before.send("a1", pose(0))
    before.settle(share)
    after = before.restarted(2)
    assert after.snapshot.pair("a1", "a2").age_s == before.snapshot.pair("a1", "a2").age_s + 2
    assert after.snapshot.robots["a1"].last_seen_ns == before.now_ns


def test_a_pose_of_the_same_boot_goes_on_where_it_was() -> None:
    after = two_groups().restarted(1)
    late = PoseArrived("a1", "b0", 7, after.now_ns - 3 * S, after.now_ns, pose(9))
    after.receive(late)
    assert after.snapshot.robots["a1"].fix.pose.centre_m[0] == 0
    after.receive(PoseArrived("a1", "b0", 8, after.now_ns, after.now_ns, pose(0.3)))
    assert after.snapshot.robots["a1"].fix.pose.centre_m[0] == 0.3


@given(st.integers(0, 2**31), st.integers(1, 25))
@settings(max_examples=15, deadline=None)
def test_what_is_restored_is_what_was_remembered(seed: int, steps: int) -> None:
    life = Life(seed)
    for _ in range(steps):
        life.step()
    memory = remember(life.scene.snapshot)
    again = remember(life.scene.restarted().snapshot)
    assert again.revision == memory.revision + (memory.revision > 0)
    assert plain(again, revision=0) == plain(memory, revision=0)


@given(st.integers(0, 2**31))
@settings(max_examples=15, deadline=None)
def test_a_life_with_restarts_goes_on_and_leaves_nothing_behind(seed: int) -> None:
    life = Life(seed)
    for _ in range(4):
        for _ in range(6):
            life.step()
            assert_agreement(life.scene.snapshot)
        before = life.scene.snapshot
        life.scene = life.scene.restarted(float(life.rng.uniform(-50, 90)))
        assert [effect for effect in life.scene.tick() if isinstance(effect, SurveyPair)] == []
        assert_agreement(life.scene.snapshot)
        assert life.scene.snapshot.groups.revision >= before.groups.revision
        assert life.scene.snapshot.groups.last_label >= before.groups.last_label
    scene = life.scene
    scene.work(scene.wait(25), share)
    scene.wait(200)
    hoods = scene.station._surveys.neighbourhoods
    assert scene.snapshot.robots == {}
    assert len(scene.station._pairs) == 0
    for places in (hoods._reaches, hoods._standing, hoods._judged, hoods._ageing, hoods._lapsed, hoods._receding):
        assert places == {}


def swarm(seed: int, restart: bool) -> tuple[dict[str, tuple[str, ...]], list[GroupsChanged]]:
    """Two planted groups that send for a while; perhaps the station starts anew in the middle."""
    scene, told = two_groups(), []
    for turn in range(12):
        if restart and turn == 6:
            scene = scene.restarted(1)
            told += scene.tick()
        scene.now_ns += S
        for k in range(len(ROBOTS)):
            told += hear(scene, (ROBOTS[(k * 5 + seed) % 6],))
    return groups(scene), changes(told)


@pytest.mark.parametrize("seed", range(3))
def test_a_swarm_ends_in_the_same_groups_with_and_without_a_restart(seed: int) -> None:
    straight, through = swarm(seed, restart=False), swarm(seed, restart=True)
    assert straight[0] == through[0]
    assert (len(straight[1]), len(through[1])) == (0, 1)
