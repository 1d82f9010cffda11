from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from covista_service.evaluation.case import Case, Pair, Surveys
from covista_service.evaluation.methods import METHODS
from covista_service.perception.camera import Features, Pose, View
from covista_service.perception.comparators.image import image_of
from covista_service.perception.survey import SurveyOptions

from tests.service.perception import swarms

COMPARATORS = ("snavely", "bruckner", "coslam", "hull", "distance")
OF_IMAGES = ("snavely", "bruckner", "hull")


def case_of(views: list[View], pairs: tuple[Pair, ...] | None = None) -> Case:
    pairs = tuple(combinations(range(len(views)), 2)) if pairs is None else pairs
    return Case(pairs, tuple(views), Surveys(pairs, views, SurveyOptions()), tuple(image_of(view) for view in views))


def row(scale: float = 1.0) -> list[View]:
    """Cameras before a wall, one further from the next each time; `scale` of the world."""
    poses = [Pose(np.eye(3), np.array([x, 0.0, 0.0]) * scale) for x in (0.0, 0.6, 1.8, 4.0)]
    return swarms.views(swarms.points_on_wall() * scale, poses)


def poor(view: View, count: int) -> View:
    return replace(view, features=only(view.features, count))


def only(features: Features, count: int) -> Features:
    return Features(features.kind, features.keypoints_px[:count], features.descriptors[:count])


@pytest.mark.parametrize("name", COMPARATORS)
def test_what_is_further_off_has_less_in_common(name: str) -> None:
    answers = METHODS[name](case_of(row()))
    found = [answers[0, other].overlap_a for other in (1, 2, 3)]
    assert all(overlap is not None and 0 <= overlap <= 1 for overlap in found)
    assert found == sorted(found, reverse=True)
    assert found[0] > found[2]
    assert all(answer.ms > 0 for answer in answers.values())


@pytest.mark.parametrize("name", COMPARATORS)
@pytest.mark.parametrize("count", [0, 1, 2, 9])
def test_few_features_in_some_or_all_views_are_no_obstacle(name: str, count: int) -> None:
    views = row()
    for some in ([poor(views[0], count), *views[1:]], [poor(view, count) for view in views]):
        answers = METHODS[name](case_of(some))
        assert len(answers) == 6
        overlaps = [q for answer in answers.values() for q in (answer.overlap_a, answer.overlap_b) if q is not None]
        assert all(0 <= overlap <= 1 for overlap in overlaps)


@pytest.mark.parametrize("name", COMPARATORS)
def test_one_image_twice_and_kinds_that_differ_are_no_obstacle(name: str) -> None:
    views = row()
    orb = Features("orb", np.full((30, 2), 5, np.float32), np.full((30, 32), 7, np.uint8))
    answers = METHODS[name](case_of([views[0], views[0], replace(views[1], features=orb), views[1]]))
    same, different = answers[0, 1], answers[0, 2]
    if name == "distance":
        assert (same.overlap_a, same.overlap_b) == (1.0, 1.0)
    elif name == "coslam":
        assert different.outcome == "no_depth"
    else:
        assert same.overlap_a == pytest.approx(1.0, abs=0.15)
        assert (different.outcome, different.overlap_a) == ("kinds_differ", None)


@pytest.mark.parametrize("name", OF_IMAGES)
def test_images_without_cameras_are_answered_all_the_same(name: str) -> None:
    known = case_of(row())
    blind = Case(known.pairs, None, {}, known.images)
    found, expected = METHODS[name](blind), METHODS[name](known)
    assert {pair: answer.overlap_a for pair, answer in found.items()} == {
        pair: answer.overlap_a for pair, answer in expected.items()
    }


def test_the_size_of_the_world_does_not_change_a_distance() -> None:
    small, large = (METHODS["distance"](case_of(row(scale))) for scale in (1.0, 50.0))
    for pair, answer in small.items():
        assert large[pair].overlap_a == pytest.approx(answer.overlap_a, rel=1e-9)
        assert answer.overlap_a == answer.overlap_b


def test_distances_are_taken_among_those_that_are_compared() -> None:
    views = row()
    alone = METHODS["distance"](case_of(views[:2]))[0, 1]
    beside = METHODS["distance"](case_of(views, ((0, 1), (2, 3))))[0, 1]
    assert alone.overlap_a == beside.overlap_a == pytest.approx(np.exp(-1))


def test_the_map_of_all_pairs_tells_what_a_camera_sees() -> None:
    views = row()
    pairs = ((0, 1), (0, 2), (1, 2))
    answer = METHODS["coslam"](case_of(views, pairs))[0, 1]
    assert answer.overlap_b is not None
    seen = 1 - 0.6 * 500 / 6 / 640
    assert answer.overlap_b == pytest.approx(seen, abs=0.1)


@pytest.mark.parametrize("name", METHODS)
def test_only_what_a_method_asks_for_is_surveyed(name: str) -> None:
    views = row()[:3]
    pairs = ((0, 1), (0, 2), (1, 2))
    told: list[None] = []
    surveys = Surveys(pairs, views, SurveyOptions(), lambda: told.append(None))
    METHODS[name](replace(case_of(views), surveys=surveys))
    if name in {"auto", "surface", "distance", *OF_IMAGES}:
        assert surveys.left == 3
    assert len(told) + surveys.left == 3


def test_a_pair_is_surveyed_once_and_a_strange_one_never() -> None:
    views = row()[:2]
    surveys = Surveys(((0, 1),), views, SurveyOptions())
    assert surveys[0, 1] is surveys[0, 1]
    assert (len(surveys), surveys.left, list(surveys)) == (1, 0, [(0, 1)])
    with pytest.raises(KeyError):
        surveys[1, 0]
    assert len(Surveys(((0, 1),), None, SurveyOptions())) == 0
