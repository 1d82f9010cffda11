import numpy as np
import pytest
from covista_service.perception.agreement import DepthPoints
from covista_service.perception.camera import Camera, Floats
from covista_service.perception.surface import COLUMNS, ROWS, SurfaceOptions, cell_centres, flat, interpolate

from tests.service.perception.scenes import CAMERA

OPTIONS = SurfaceOptions()


def spread(inverse_depths_at: Floats, positions: Floats) -> DepthPoints:
    count = len(positions)
    return DepthPoints(positions, inverse_depths_at, np.full(count, 1e-4), np.ones(count))


def grid(camera: Camera = CAMERA, count: int = 300, seed: int = 0) -> Floats:
    random = np.random.default_rng(seed)
    return np.column_stack((random.uniform(0, camera.width - 1, count), random.uniform(0, camera.height - 1, count)))


def affine(positions: Floats) -> Floats:
    return 0.3 + positions @ np.array([2e-4, -1e-4])


def test_planes_come_out_as_they_are() -> None:
    positions = grid()
    surface = interpolate(spread(affine(positions), positions), CAMERA, OPTIONS)
    expected = affine(cell_centres(CAMERA)).reshape(ROWS, COLUMNS)
    assert np.median(np.abs(surface.inverse_depth / expected - 1)) < 0.002
    assert np.abs(surface.inverse_depth / expected - 1).max() < 0.1


def test_one_wrong_point_does_not_bend_the_surface() -> None:
    positions = grid()
    right = affine(positions)
    wrong = right.copy()
    wrong[17] *= 4
    straight, bent = (interpolate(spread(rho, positions), CAMERA, OPTIONS).inverse_depth for rho in (right, wrong))
    # Only the cells whose nearest point is the wrong one may follow it.
    assert (np.abs(bent / straight - 1) > 0.05).mean() < 0.02


def test_a_surface_scales_with_the_scene() -> None:
    positions = grid()
    one = spread(affine(positions), positions)
    ten = DepthPoints(positions, one.inverse_depths / 10, one.sigmas / 10, one.confidences)
    small, large = (interpolate(points, CAMERA, OPTIONS) for points in (one, ten))
    assert large.inverse_depth * 10 == pytest.approx(small.inverse_depth, rel=1e-9)
    assert large.sigma == pytest.approx(small.sigma, rel=1e-9)


def test_resolution_does_not_matter() -> None:
    double = Camera(np.diag([2.0, 2.0, 1.0]) @ CAMERA.matrix, 2 * CAMERA.width, 2 * CAMERA.height)
    positions = grid()
    small = interpolate(spread(affine(positions), positions), CAMERA, OPTIONS)
    large = interpolate(spread(affine(positions), 2 * positions + 0.5), double, OPTIONS)
    assert large.inverse_depth == pytest.approx(small.inverse_depth, rel=1e-6)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_few_points_are_enough(count: int) -> None:
    positions = grid(count=count)
    surface = interpolate(spread(np.full(count, 0.25), positions), CAMERA, OPTIONS)
    assert surface.inverse_depth == pytest.approx(0.25)


def test_a_thumbnail_keeps_depths_on_their_side_of_an_edge() -> None:
    positions = grid(count=150)
    near = positions[:, 0] < CAMERA.width / 2
    points = spread(np.where(near, 1.0, 0.2), positions)
    thumbnail = np.full((72, 96), 200, np.uint8)
    thumbnail[:, :48] = 30
    expected = np.where(cell_centres(CAMERA)[:, 0] < CAMERA.width / 2, 1.0, 0.2).reshape(ROWS, COLUMNS)
    blind = np.abs(interpolate(points, CAMERA, OPTIONS).inverse_depth - expected).mean()
    aware = np.abs(interpolate(points, CAMERA, OPTIONS, thumbnail).inverse_depth - expected).mean()
    assert aware < 0.7 * blind


def test_a_flat_surface_has_one_depth() -> None:
    assert (flat(0.5).inverse_depth == 0.5).all()
