import warnings

import numpy as np
import pytest
from covista_service.perception.camera import Camera, relative
from covista_service.perception.surface import COLUMNS, ROWS, Surface, SurfaceOptions, cell_centres, flat
from covista_service.perception.warp import Carried

from tests.service.perception.scenes import CAMERA, ORIGIN, beside, turn, wall

OPTIONS = SurfaceOptions()


def warped(
    surface: Surface, camera: Camera, rotation: np.ndarray, translation: np.ndarray, to: Camera
) -> Surface | None:
    return Carried(surface, camera, rotation, translation).over(to, OPTIONS)


def of_plane(u: np.ndarray, camera: Camera = CAMERA) -> Surface:
    """The surface of a camera that sees the plane u . X + 1 = 0."""
    pixels = np.column_stack((cell_centres(camera), np.ones(ROWS * COLUMNS)))
    return Surface(-(pixels @ camera.rays_from_pixels.T @ u).reshape(ROWS, COLUMNS), np.full((ROWS, COLUMNS), 0.01))


@pytest.mark.parametrize("seed", range(3))
def test_a_plane_is_carried_over_exactly(seed: int) -> None:
    (u,), second = wall(), beside(seed)
    rotation, translation = relative(ORIGIN, second)
    # u2 = R u / (1 + u . C2) with C2 = -R' t (section 3 of the method).
    there = rotation @ u / (1 - u @ rotation.T @ translation)
    carried = warped(of_plane(u), CAMERA, rotation, translation, CAMERA)
    assert carried is not None
    expected = of_plane(there).inverse_depth
    inner = (slice(4, -4), slice(4, -4))
    np.testing.assert_allclose(carried.inverse_depth[inner], expected[inner], rtol=0.02)


def test_a_camera_that_looks_away_sees_none_of_it() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert warped(flat(0.2), CAMERA, turn(0, np.pi, 0), np.zeros(3), CAMERA) is None


def test_a_camera_of_another_size_sees_the_same() -> None:
    half = Camera(np.diag([0.5, 0.5, 1.0]) @ CAMERA.matrix, CAMERA.width // 2, CAMERA.height // 2)
    carried = warped(flat(0.2), CAMERA, np.eye(3), np.zeros(3), half)
    assert carried is not None
    np.testing.assert_allclose(carried.inverse_depth, 0.2, rtol=1e-6)


def test_what_is_carried_over_is_less_sure_each_time() -> None:
    surface = flat(0.2, 0.02)
    for _ in range(20):
        carried = warped(surface, CAMERA, np.eye(3), np.zeros(3), CAMERA)
        assert carried is not None
        assert (carried.sigma > min(surface.sigma.max(), 0.29)).all()
        assert (carried.sigma <= 0.3 + 1e-9).all()
        surface = carried
