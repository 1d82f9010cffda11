"""What a person wants of the station: other settings, and robots to be forgotten."""

from dataclasses import replace

from covista_schemas.reports import EventKind, FoundBy, Status
from covista_service.station.events import (
    BuildSurfaces,
    ExtractFeatures,
    FeaturesExtracted,
    ForgetRobot,
    Happened,
    SettingsGiven,
    SurveyDone,
    SurveyPair,
    Tick,
    TokenLost,
    TokenSeen,
)
from covista_service.station.ledger import FORGOTTEN, Counts
from covista_service.station.options import GroupingOptions

from tests.service.station.scenes import FEATURES, Scene, comparison, happenings, measured, pose
from tests.service.station.test_groups import changes, groups, share, two_groups


def test_settings_that_are_given_hold_from_the_next_tick_and_are_told_of_with_who_gave_them() -> None:
    scene = two_groups()
    (told,) = scene.receive(SettingsGiven(GroupingOptions(groups=1), "groups: 1", by="ada"))
    assert told == Happened(EventKind.SETTINGS, scene.now_ns, "groups: 1", by="ada")
    assert scene.snapshot.groups.settings.groups == 1
    assert [kind for kind, _ in happenings(scene.tick())] == ["groups", "merge"]
    assert scene.station.options.grouping.groups == 1


def test_settings_that_are_in_force_already_are_no_news() -> None:
    scene = two_groups()
    same = replace(scene.station.options.grouping)
    assert scene.receive(SettingsGiven(same, "nothing", by="ada")) == []
    revision = scene.snapshot.similarity.revision
    assert scene.tick() == []
    assert scene.snapshot.similarity.revision == revision


def test_a_robot_is_forgotten_with_all_that_was_known_of_it() -> None:
    scene = two_groups()
    label = scene.snapshot.robots["a1"].group
    (told,) = scene.receive(ForgetRobot("a1", by="ada"))
    assert told == Happened(EventKind.STATUS, scene.now_ns, "a1 is forgotten", ("a1",), by="ada")
    assert "a1" not in scene.snapshot.robots
    assert not any("a1" in pair for pair in scene.snapshot.records)
    assert ("leave", f"a1 left {label}") in happenings(scene.tick())
    assert groups(scene)[label] == ("a2", "a3")
    assert scene.receive(ForgetRobot("a1")) == []
    assert scene.receive(ForgetRobot("nobody")) == []


def test_a_robot_that_still_sends_comes_back_as_a_newcomer() -> None:
    scene = two_groups()
    scene.receive(TokenSeen("a1", "b0"), ForgetRobot("a1"))
    scene.tick()
    assert scene.wait(1) == []
    assert "a1" not in scene.snapshot.robots
    scene.send_pose("a1", pose(0))
    told = happenings(scene.settle(share))
    assert ("status", "a1 is live") in told
    assert any(kind == "join" and text.startswith("a1 joined") for kind, text in told)
    assert scene.snapshot.pair("a1", "a2").found_by is FoundBy.UNKNOWN
    scene.send("a1", pose(0))
    scene.settle(share)
    assert scene.snapshot.pair("a1", "a2").found_by is FoundBy.IMAGE
    view = scene.snapshot.robots["a1"]
    assert view.group == scene.snapshot.robots["a2"].group
    assert view.keyframes == Counts(received=1, used=1, missing=1)
    assert scene.station.census().accounts["keyframe"].used == 7


def test_a_robot_that_comes_back_lives_by_the_token_that_it_has_had_all_the_time() -> None:
    scene = Scene()
    scene.receive(TokenSeen("r1", "b0"), TokenSeen("r1", "b1"), ForgetRobot("r1"), TokenLost("r1", "b0"))
    scene.send_pose("r1", pose(0))
    scene.wait(100)
    assert scene.snapshot.robots["r1"].status is Status.LIVE
    scene.receive(TokenLost("r1", "b1"))
    scene.wait(5)
    assert scene.snapshot.robots["r1"].status is Status.STALE
    scene.receive(TokenSeen("r2", "b0"), ForgetRobot("r2"), TokenLost("r2", "b0"))
    scene.send_pose("r2", pose(0))
    scene.wait(5)
    assert scene.snapshot.robots["r2"].status is Status.STALE


def test_surveys_of_a_robot_that_is_forgotten_meanwhile_are_dropped_when_they_return() -> None:
    scene = Scene.of(capacity=1)
    scene.send("r1", pose(0))
    scene.send("r2", pose(0.1))
    (job,) = [effect for effect in scene.tick() if isinstance(effect, SurveyPair)]
    scene.receive(ForgetRobot("r1"))
    assert scene.snapshot.workload.under_way == 1
    scene.send("r1", pose(0))
    scene.tick()
    assert scene.receive(SurveyDone(job.first, job.second, comparison(9))) == []
    assert scene.snapshot.pair("r1", "r2").found_by is FoundBy.UNKNOWN
    scene.settle()
    assert scene.snapshot.pair("r1", "r2").found_by is FoundBy.IMAGE
    assert scene.snapshot.workload.under_way == 0


def test_surfaces_of_a_robot_that_is_forgotten_meanwhile_are_dropped_when_they_return() -> None:
    scene = Scene.of(capacity=2)
    scene.send("r1", pose(0))
    scene.send("r2", pose(0.1))
    (job,) = [effect for effect in scene.tick() if isinstance(effect, SurveyPair)]
    scene.done(job, measured())
    build = next(effect for effect in scene.receive(Tick()) if isinstance(effect, BuildSurfaces))
    scene.receive(ForgetRobot("r1"))
    scene.receive(scene.wall_ahead(build))
    scene.tick()
    assert list(scene.snapshot.robots) == ["r2"]
    assert scene.snapshot.records == {}
    scene.send("r1", pose(0))
    scene.settle()
    assert scene.snapshot.pair("r1", "r2").found_by is FoundBy.IMAGE


def test_an_extraction_of_a_robot_that_is_forgotten_meanwhile_is_dropped_and_accounted_for() -> None:
    scene = Scene()
    (job,) = scene.send("r1", image=True)
    assert isinstance(job, ExtractFeatures)
    scene.receive(ForgetRobot("r1"))
    assert scene.receive(FeaturesExtracted(job.keyframe.id, FEATURES)) == []
    assert scene.snapshot.robots == {}
    assert scene.station.census().accounts["keyframe"] == Counts(received=1, dropped={FORGOTTEN: 1})


def test_the_last_robot_of_a_group_takes_its_label_with_it() -> None:
    scene = Scene()
    scene.send("r1", pose(0))
    scene.settle()
    scene.receive(ForgetRobot("r1"))
    (change,) = changes(scene.tick())
    assert change.robots == ("r1",)
    scene.send("r1", pose(0))
    scene.settle()
    assert list(groups(scene)) == ["g2"]
