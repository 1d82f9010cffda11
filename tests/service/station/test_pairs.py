"""What is answered about a pair: measured, predicted, decayed, unknown; and on which keyframes."""

import numpy as np
import pytest
from covista_schemas.reports import FoundBy
from covista_service.perception.comparison import Comparison, Outcome
from covista_service.station.events import BuildSurfaces, KeyframeId, SurfacesBuilt, SurveyDone, SurveyPair, Tick
from covista_service.station.snapshot import PairView

from tests.service.station.scenes import (
    BACK,
    NOTHING,
    SEEN,
    Found,
    Scene,
    comparison,
    happenings,
    measured,
    pose,
    surveys,
)

# One metre aside at four metres: 75 px of 320, to within half a cell of the surface at either side.
ASIDE = pytest.approx(1 - 75 / 320, abs=1 / 48)


def pair(scene: Scene, a: str = "r1", b: str = "r2") -> PairView:
    return scene.snapshot.pair(a, b)


def names(view: PairView) -> tuple[int, int] | None:
    if view.keyframe_a is None or view.keyframe_b is None:
        return None
    return view.keyframe_a.id.sequence, view.keyframe_b.id.sequence


def two_robots(find=lambda job: measured(), **options: object) -> Scene:
    scene = Scene.of(**options)
    scene.send("r1", pose(0))
    scene.send("r2", pose(1))
    scene.settle(find)
    return scene


def test_a_pair_that_was_not_surveyed_is_unknown() -> None:
    scene = Scene()
    scene.send("r1")
    scene.send("r2")
    view = pair(scene)
    assert (view.found_by, view.overlap_a, view.overlap_b, view.age_s) == (FoundBy.UNKNOWN, None, None, None)
    assert view.outcome == "not_surveyed"


def test_a_survey_answers_for_the_smaller_id_first() -> None:
    scene = two_robots(lambda job: measured(0.3, 0.7))
    for view in (pair(scene, "r1", "r2"), pair(scene, "r2", "r1")):
        assert (view.a, view.b) == ("r1", "r2")
        assert (view.overlap_a, view.overlap_b, view.found_by) == (0.3, 0.7, FoundBy.IMAGE)
        assert (view.outcome, view.inliers, view.explained) == ("measured", 9, True)


def test_an_unknown_robot_makes_no_pair() -> None:
    with pytest.raises(KeyError):
        pair(two_robots(), "r1", "r9")


def test_a_new_keyframe_inherits_the_answer_until_it_is_surveyed() -> None:
    scene = two_robots(lambda job: measured(0.3, 0.7))
    scene.wait(1)
    scene.send("r1", pose(0.5))
    effects = scene.tick()
    assert surveys(effects) == [("r1", "r2")]
    view = pair(scene)
    assert (view.overlap_a, names(view), view.age_s, view.found_by) == (0.3, (1, 0), 1.0, FoundBy.PREDICTED)
    scene.work(effects, lambda job: measured(0.4, 0.8))
    assert (pair(scene).overlap_a, names(pair(scene)), pair(scene).age_s) == (0.4, (1, 0), 0.0)


def test_a_survey_without_a_result_leaves_the_word_to_the_prediction() -> None:
    scene = two_robots(lambda job: measured(0.3, 0.7))
    scene.send("r1", pose(0))
    scene.settle(lambda job: NOTHING)
    view = pair(scene)
    assert (view.found_by, view.outcome, names(view)) == (FoundBy.PREDICTED, "few_matches", (1, 0))
    assert (view.overlap_a, view.overlap_b) == (ASIDE, ASIDE)
    assert not view.compared or not view.compared.pose.verified


def test_overlaps_are_read_from_the_surfaces() -> None:
    view = pair(two_robots(lambda job: SEEN))
    assert (view.found_by, view.overlap_a, view.overlap_b) == (FoundBy.IMAGE, ASIDE, ASIDE)
    assert view.outlooks is not None
    assert [outlook.keyframe.id.robot for outlook in view.outlooks] == ["r1", "r2"]


def test_without_a_depth_nothing_is_predicted() -> None:
    view = pair(two_robots(lambda job: NOTHING))
    assert (view.found_by, view.overlap_a, view.outcome) == (FoundBy.UNKNOWN, None, "few_matches")


def test_depths_of_other_pairs_serve_a_pair_without_matches() -> None:
    scene = Scene()
    for number, x_m in enumerate((0.0, 1.0, 2.0)):
        scene.send(f"r{number + 1}", pose(x_m))
    scene.settle(lambda job: NOTHING if (job.first.robot, job.second.robot) == ("r1", "r3") else measured())
    view = pair(scene, "r1", "r3")
    assert view.found_by is FoundBy.PREDICTED
    assert view.overlap_a == pytest.approx(1 - 150 / 320, abs=1 / 48)


def test_who_looks_away_is_predicted_to_see_nothing_in_common() -> None:
    scene = two_robots()
    scene.send("r3", pose(0, BACK))
    scene.send("r4", pose(1, BACK))
    scene.settle(lambda job: measured() if job.first.robot == "r3" and job.second.robot == "r4" else NOTHING)
    view = pair(scene, "r1", "r4")
    assert (view.overlap_a, view.overlap_b, view.found_by) == (0.0, 0.0, FoundBy.PREDICTED)


def test_a_keyframe_that_nothing_matches_sees_what_the_last_one_saw() -> None:
    """The surface is carried over by the motion between the two."""
    scene = two_robots(lambda job: SEEN)
    scene.send("r1", pose(0.5))
    scene.settle(lambda job: NOTHING)
    view = pair(scene)
    assert (view.found_by, names(view)) == (FoundBy.PREDICTED, (1, 0))
    assert view.overlap_a == pytest.approx(1 - 37.5 / 320, abs=1 / 48)


def test_a_robot_s_own_motion_gives_it_a_surface() -> None:
    scene = two_robots(lambda job: SEEN)
    scene.send("r1", pose(0.5))
    scene.settle(lambda job: SEEN if job.first.robot == job.second.robot else NOTHING)
    (outlook, _) = pair(scene).outlooks or (None, None)
    assert outlook is not None
    assert (outlook.keyframe.id.sequence, outlook.points, pair(scene).found_by) == (1, 9, FoundBy.PREDICTED)


def test_depths_that_a_replaced_keyframe_gave_stay_with_those_it_gave_them_to() -> None:
    scene = two_robots(lambda job: SEEN)
    for _ in range(3):
        scene.send("r2", pose(1))
        scene.settle(lambda job: SEEN)
    (outlook, _) = pair(scene).outlooks or (None, None)
    assert outlook is not None
    assert (outlook.keyframe.id.sequence, outlook.points) == (0, 4 * 9)


def test_surfaces_that_cannot_be_built_are_a_warning_and_hold_up_nobody() -> None:
    scene = Scene()
    for robot, x_m in (("r1", 0), ("r2", 1), ("r3", 2)):
        scene.send(robot, pose(x_m))
    first, *todo = [effect for effect in scene.tick() if isinstance(effect, SurveyPair)]
    scene.done(first, SEEN)
    building, *more = scene.receive(Tick())
    assert isinstance(building, BuildSurfaces)
    effects = scene.receive(SurfacesBuilt(building, None, problem="worker died"))
    assert happenings(effects) == [("warning", "the surfaces of r1 and r2 could not be built: worker died")]
    assert pair(scene).found_by is FoundBy.UNKNOWN
    scene.work([*todo, *more])
    assert pair(scene, "r1", "r3").found_by is FoundBy.IMAGE


def test_an_answer_decays_and_becomes_unknown() -> None:
    scene = two_robots(forget_after_s=5000)
    scene.wait(59.9)
    assert pair(scene).found_by is FoundBy.IMAGE
    scene.wait(0.1)
    view = pair(scene)
    assert (view.found_by, view.overlap_a, view.overlap_b) == (FoundBy.DECAYED, 0.5, 0.6)
    assert view.age_s == pytest.approx(60)
    scene.send_pose("r1", pose(0))
    scene.send_pose("r2", pose(1))
    scene.wait(539.9)
    assert pair(scene).found_by is FoundBy.DECAYED
    scene.wait(0.1)
    view = pair(scene)
    assert (view.found_by, view.overlap_a, view.age_s, names(view)) == (FoundBy.UNKNOWN, None, None, None)


def test_an_unknown_pair_is_unknown_in_the_matrix_too() -> None:
    scene = two_robots(forget_after_s=5000, gone_after_s=5000)
    assert scene.snapshot.similarity.overlap.tolist() == [[1, 0.5], [0.6, 1]]
    scene.wait(600)
    assert np.isnan(scene.snapshot.similarity.overlap).tolist() == [[False, True], [True, False]]


def test_ages_follow_the_moment_that_is_asked_for() -> None:
    scene = two_robots()
    later = scene.station.snapshot(scene.now_ns + 70_000_000_000)
    assert later.pair("r1", "r2").found_by is FoundBy.DECAYED
    assert scene.snapshot.pair("r1", "r2").found_by is FoundBy.IMAGE


def test_a_gone_robot_is_answered_for_and_surveyed_until_it_is_forgotten() -> None:
    scene = two_robots()
    scene.wait(40)
    scene.send("r1", pose(0.1))
    assert surveys(scene.settle()) == [("r1", "r2")]
    assert pair(scene).found_by is FoundBy.IMAGE


def test_a_forgotten_robot_takes_its_pairs_along() -> None:
    scene = two_robots()
    scene.wait(300)
    scene.send("r1", pose(0.1))
    effects = scene.tick()
    scene.wait(300)
    assert list(scene.snapshot.records) == []
    scene.work(effects)
    assert list(scene.snapshot.records) == []


def test_a_survey_that_failed_is_a_warning_and_no_answer() -> None:
    scene = Scene()
    scene.send("r1")
    scene.send("r2")
    scene.tick()
    first, second = KeyframeId("r1", "b0", 0), KeyframeId("r2", "b0", 0)
    effects = scene.receive(SurveyDone(first, second, None, "worker died"))
    assert happenings(effects) == [("warning", "the survey of r1 and r2 failed: worker died")]
    assert (pair(scene).found_by, pair(scene).outcome) == (FoundBy.UNKNOWN, "failed")
    assert surveys(scene.settle()) == []


def test_a_result_that_nobody_asked_for_changes_nothing() -> None:
    scene = two_robots()
    first, second = KeyframeId("r1", "b0", 0), KeyframeId("r2", "b0", 0)
    scene.receive(SurveyDone(first, second, NOTHING.comparison))
    scene.receive(SurveyDone(KeyframeId("r7", "b0", 0), second, NOTHING.comparison))
    scene.tick()
    assert pair(scene).overlap_a == 0.5


@pytest.mark.parametrize(
    ("found", "outcome"),
    [
        (comparison(9), Outcome.MEASURED),
        (comparison(9, verified=False), Outcome.UNVERIFIED),
        (comparison(3, verified=False, enough=False), Outcome.FEW_MATCHES),
        (comparison(0, verified=False, enough=False, comparable=False), Outcome.KINDS_DIFFER),
    ],
)
def test_every_outcome_can_be_read(found: Comparison, outcome: Outcome) -> None:
    assert pair(two_robots(lambda job: Found(found))).outcome == outcome


def test_every_pair_of_robots_stands_in_the_list_once() -> None:
    scene = Scene()
    for robot in ("r3", "r1", "r2"):
        scene.send(robot)
    assert [(view.a, view.b) for view in scene.snapshot.pairs()] == [("r1", "r2"), ("r1", "r3"), ("r2", "r3")]


def test_a_renewed_answer_does_not_hold_up_the_decay_of_others() -> None:
    scene = two_robots(forget_after_s=5000, gone_after_s=5000)
    scene.send("r3", pose(2))
    scene.settle()
    for _ in range(6):
        scene.wait(100)
        scene.send("r1", pose(0))
        scene.settle()
    assert scene.snapshot.pair("r1", "r2").found_by is FoundBy.IMAGE
    assert scene.snapshot.pair("r2", "r3").found_by is FoundBy.UNKNOWN
    overlap = scene.snapshot.similarity.overlap
    assert np.isnan(overlap[1:, 1:]).tolist() == [[False, True], [True, False]]
