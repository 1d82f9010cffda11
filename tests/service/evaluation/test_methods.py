from __future__ import annotations

import numpy as np
import pytest
from covista_service.evaluation.case import Case, TimedSurvey
from covista_service.evaluation.methods import METHODS
from covista_service.perception.camera import Camera, Features, Pose, View
from covista_service.perception.survey import Outcome, Survey

CAMERA = Camera(np.array([[300.0, 0, 159.5], [0, 300, 119.5], [0, 0, 1]]), 320, 240)
NO_FEATURES = Features("rootsift", np.zeros((0, 2), np.float32), np.zeros((0, 128), np.uint8))


def view(x_m: float) -> View:
    return View(CAMERA, Pose(np.eye(3), np.array([x_m, 0.0, 0.0])), NO_FEATURES)


def measured(depth_m: float) -> TimedSurvey:
    depths = np.full(9, depth_m)
    return TimedSurvey(Survey(Outcome.MEASURED, 0.7, 0.6, inliers=9, depths_first=depths, depths_second=depths), ms=4.0)


HOPELESS = TimedSurvey(Survey(Outcome.FEW_MATCHES), ms=1.0)


def test_planes_say_what_the_surveys_say() -> None:
    answers = METHODS["planes"](Case(((0, 1), (0, 2)), (view(0),) * 3, {(0, 1): measured(5.0), (0, 2): HOPELESS}))
    first, second = answers[0, 1], answers[0, 2]
    assert (first.found_by, first.outcome, first.overlap_a, first.overlap_b) == ("image", "measured", 0.7, 0.6)
    assert (first.inliers, first.ms) == (9, 4.0)
    assert (second.found_by, second.outcome, second.overlap_a) == ("unknown", "few_matches", None)


def test_frusta_meet_at_the_median_depth() -> None:
    half_a_picture_m = 160 * 5.0 / 300
    case = Case(((0, 1),), (view(0), view(half_a_picture_m)), {(0, 1): measured(5.0)})
    answer = METHODS["frustum"](case)[0, 1]
    assert answer.found_by == "predicted"
    assert (answer.overlap_a, answer.overlap_b) == (pytest.approx(0.5), pytest.approx(0.5))


def test_a_keyframe_without_points_takes_the_depth_of_those_it_is_compared_with() -> None:
    views = (view(0), view(0), view(160 * 5.0 / 300), view(0), view(0))
    pairs = ((0, 1), (0, 2), (1, 2), (3, 4))
    surveys = {(0, 1): measured(5.0), (0, 2): HOPELESS, (1, 2): HOPELESS, (3, 4): HOPELESS}
    answers = METHODS["frustum"](Case(pairs, views, surveys))
    assert answers[0, 2].overlap_a == pytest.approx(0.5)
    assert (answers[3, 4].outcome, answers[3, 4].overlap_a) == ("no_depth", None)


@pytest.mark.parametrize("name", METHODS)
def test_every_pair_gets_a_named_outcome_without_cameras(name: str) -> None:
    answers = METHODS[name](Case(((0, 1), (1, 2)), None, {}))
    assert [answer.outcome for answer in answers.values()] == ["no_camera", "no_camera"]
    assert all(answer.overlap_a is None and answer.found_by == "unknown" for answer in answers.values())


@pytest.mark.parametrize("name", ["auto", "surface", "dense", "dense_at_jumps"])
def test_without_a_match_surfaces_say_so(name: str) -> None:
    answers = METHODS[name](Case(((0, 1),), (view(0), view(1)), {}))
    assert (answers[0, 1].found_by, answers[0, 1].outcome, answers[0, 1].overlap_a) == ("unknown", "no_depth", None)
