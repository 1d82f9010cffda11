import numpy as np
import pytest
from covista_service.perception.camera import Floats
from covista_service.perception.comparators.coslam import CODE, PAPER, Look, groups, look, may_merge, overlaps, share

from tests.service.perception.scenes import CAMERA, ORIGIN, project

WHOLE = Look(points=100, in_view=100, features=100, inside=100, area=1.0)


def scattered(count: int = 300, seed: int = 0) -> Floats:
    """Points (n, 3) all over what the camera sees, 5 m ahead."""
    random = np.random.default_rng(seed)
    pixels = np.column_stack((random.uniform(0, 639, count), random.uniform(0, 479, count), np.ones(count)))
    return 5 * pixels @ CAMERA.rays_from_pixels.T


def seen(in_view: int = 60, features: int = 60, inside: int = 60, area: float = 1.0) -> Look:
    return Look(points=100, in_view=in_view, features=features, inside=inside, area=area)


@pytest.mark.parametrize("options", [CODE, PAPER])
def test_who_sees_all_that_another_has_mapped_shares_all(options) -> None:
    points = scattered()
    found = look(points, CAMERA, project(CAMERA, ORIGIN, points))
    assert (found.points, found.in_view, found.inside) == (300, 300, 300)
    assert share(found, options) == pytest.approx(1.0, abs=0.06)
    assert overlaps(found, options)


@pytest.mark.parametrize("options", [CODE, PAPER])
def test_what_lies_behind_or_aside_is_not_in_view(options) -> None:
    points = scattered()
    features_px = project(CAMERA, ORIGIN, points)
    for elsewhere in (points * (1, 1, -1), points + np.array([50, 0, 0]), -points, points[:0]):
        found = look(elsewhere, CAMERA, features_px)
        assert (found.in_view, share(found, options), overlaps(found, options)) == (0, 0.0, False)


def test_the_hull_holds_the_features_of_its_part_alone() -> None:
    points = scattered(1000)
    features_px = project(CAMERA, ORIGIN, points)
    left = look(points[features_px[:, 0] < 320], CAMERA, features_px)
    assert left.area == pytest.approx(0.5, abs=0.03)
    assert left.inside / left.features == pytest.approx(0.5, abs=0.04)
    assert look(points, CAMERA, features_px[:0]).inside == 0


def test_points_on_a_line_cover_nothing() -> None:
    on_line = np.column_stack((np.linspace(-1, 1, 30), np.zeros(30), np.full(30, 5.0)))
    found = look(on_line, CAMERA, project(CAMERA, ORIGIN, scattered()))
    assert (found.in_view, found.inside) == (30, 0)
    assert found.area == pytest.approx(0.0, abs=1e-6)


def test_ten_points_and_half_the_features_do_by_the_code() -> None:
    assert overlaps(seen(in_view=10, inside=30))
    assert not overlaps(seen(in_view=9, inside=30))
    assert not overlaps(seen(inside=29))
    assert overlaps(seen(features=1000, inside=51))
    assert not overlaps(seen(features=1000, inside=50))
    assert not overlaps(seen(in_view=9, features=1000, inside=51))
    assert not overlaps(seen(features=0, inside=0))


def test_a_third_of_the_points_and_most_of_the_area_do_by_the_paper() -> None:
    assert overlaps(seen(in_view=30, area=0.7), PAPER)
    assert not overlaps(seen(in_view=29, area=0.7), PAPER)
    assert not overlaps(seen(in_view=100, area=0.69), PAPER)


def test_groups_merge_when_both_see_enough_near_by_and_after_a_rest() -> None:
    little = seen(inside=10)
    assert may_merge(WHOLE, WHOLE, 6.0, 1.0, 130)
    assert not may_merge(WHOLE, WHOLE, 6.01, 1.0, 130)
    assert not may_merge(WHOLE, WHOLE, 6.0, 1.0, 129)
    assert not may_merge(WHOLE, little, 1.0, 1.0, 130)
    assert not may_merge(little, WHOLE, 1.0, 1.0, 130)


def test_groups_split_when_no_point_or_too_long_a_way_joins_them() -> None:
    shared = np.array([[9, 1, 0, 0], [1, 9, 1, 0], [0, 1, 9, 5], [0, 0, 5, 9]])
    distance_m = np.abs(np.subtract.outer([0.0, 1, 2, 3], [0.0, 1, 2, 3]))
    assert groups(shared, distance_m, 1.0).tolist() == [0, 0, 0, 0]
    distance_m[2, 3] = distance_m[3, 2] = 6.01
    assert groups(shared, distance_m, 1.0).tolist() == [0, 0, 0, 1]
    shared[0, 1] = shared[1, 0] = 0
    assert groups(shared, distance_m, 1.0).tolist() == [0, 1, 1, 2]
    assert groups(np.zeros((0, 0), np.int64), np.zeros((0, 0)), 1.0).tolist() == []
