import numpy as np
import pytest
from covista_service.perception.camera import relative
from covista_service.perception.sightings import Sightings
from covista_service.perception.triangulation import TriangulationOptions, triangulate

from tests.service.perception.scenes import CAMERA, ORIGIN, beside, project

OPTIONS = TriangulationOptions()


def cloud(seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    return random.uniform([-1.5, -1, 3], [1.5, 1, 8], (50, 3))


def seen(points: np.ndarray, seed: int = 0) -> Sightings:
    return Sightings(CAMERA, CAMERA, project(CAMERA, ORIGIN, points), project(CAMERA, beside(seed), points))


@pytest.mark.parametrize("w", [0.1, 1.0, 10.0])
def test_exact_matches_give_exact_points_in_units_of_the_baseline(w: float) -> None:
    points = cloud()
    rotation, translation = relative(ORIGIN, beside())
    found = triangulate(seen(points), rotation, w * translation, OPTIONS)
    assert found.kept.all()
    np.testing.assert_allclose(found.rays * found.depths_first[:, None], w * points, rtol=1e-9)
    np.testing.assert_allclose(found.depths_second, w * ((points - beside().centre_m) @ rotation.T[:, 2]), rtol=1e-9)


def test_parallax_is_how_far_a_point_moves_from_its_far_place() -> None:
    points = cloud()
    rotation, translation = relative(ORIGIN, beside())
    sightings = seen(points)
    far = project(CAMERA, beside(), 1e9 * points)
    expected = np.linalg.norm(sightings.second_px - far, axis=1)
    np.testing.assert_allclose(triangulate(sightings, rotation, translation, OPTIONS).parallax_px, expected, rtol=1e-5)


def test_points_behind_are_not_kept() -> None:
    rotation, translation = relative(ORIGIN, beside())
    assert not triangulate(seen(cloud()), rotation, -translation, OPTIONS).kept.any()


def test_matches_off_their_epipolar_lines_are_not_kept() -> None:
    rotation, translation = relative(ORIGIN, beside())
    sightings = seen(cloud())
    off = Sightings(CAMERA, CAMERA, sightings.first_px, sightings.second_px + np.array([0, 12.0]))
    assert triangulate(off, rotation, translation, OPTIONS).kept.mean() < 0.1


def test_without_a_baseline_nothing_is_kept_and_all_is_finite() -> None:
    found = triangulate(seen(cloud()), np.eye(3), np.zeros(3), OPTIONS)
    assert not found.kept.any()
    for values in (found.inverse_depths, found.depths_first, found.depths_second, found.shifts_px):
        assert np.isfinite(values).all()


def test_no_matches() -> None:
    none = Sightings(CAMERA, CAMERA, np.zeros((0, 2)), np.zeros((0, 2)))
    assert len(triangulate(none, np.eye(3), np.ones(3), OPTIONS).kept) == 0
