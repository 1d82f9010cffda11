"""Surfaces that flow along with their cameras."""

import numpy as np
import pytest
from covista_clients.simulation import worlds
from covista_clients.simulation.sight import cast, sight
from covista_clients.simulation.viewing import facing, pinhole, world_from_camera
from covista_service.perception.camera import Camera, Pose, relative
from covista_service.perception.flow import flow
from covista_service.perception.surface import COLUMNS, ROWS, Surface, SurfaceOptions, cell_centres, flat
from covista_service.perception.visibility import Seeing, VisibilityOptions, seen
from covista_service.perception.warp import Carried
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.service.perception.scenes import CAMERA, ORIGIN, beside, plane, turn, wall

TURNS = st.tuples(*[st.floats(-3.2, 3.2)] * 3)
STEPS = st.tuples(*[st.floats(-30, 30)] * 3)


def moved(
    surface: Surface, rotation: np.ndarray, translation: np.ndarray, camera: Camera = CAMERA, to: Camera | None = None
) -> Surface:
    (found,) = flow([Seeing(camera, surface)], rotation[None], np.asarray(translation, float)[None], [to or camera])
    return found


def of_plane(u: np.ndarray, camera: Camera = CAMERA) -> np.ndarray:
    """Inverse depth of the plane u . X + 1 = 0."""
    pixels = np.column_stack((cell_centres(camera), np.ones(ROWS * COLUMNS)))
    return -(pixels @ camera.rays_from_pixels.T @ u).reshape(ROWS, COLUMNS)


def after(u: np.ndarray, rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    """The same plane for X_2 = R X_1 + t: u2 = R u / (1 + u . C2) with C2 = -R' t (section 3 of the method)."""
    return rotation @ u / (1 - u @ rotation.T @ translation)


def told_of(camera: Camera, rotation: np.ndarray, translation: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Cells (ROWS, COLUMNS) of the second image that lie between centres of cells of the first."""
    pixels = np.column_stack((cell_centres(camera), np.ones(ROWS * COLUMNS)))
    there = pixels @ camera.rays_from_pixels.T / depth.reshape(-1, 1)
    back = (there - translation) @ rotation @ camera.matrix.T
    x, y = (back[:, :2] / back[:, 2:]).T
    half_x, half_y = camera.width / COLUMNS / 2, camera.height / ROWS / 2
    inside = (back[:, 2] > 0) & (x > half_x) & (x < camera.width - half_x - 1)
    return (inside & (y > half_y) & (y < camera.height - half_y - 1)).reshape(ROWS, COLUMNS)


def random_surface(seed: int) -> Surface:
    rng = np.random.default_rng(seed)
    return Surface(np.exp(rng.normal(-1.5, 0.7, (ROWS, COLUMNS))), rng.uniform(0.005, 0.5, (ROWS, COLUMNS)))


@given(st.integers(0, 99))
@settings(max_examples=20, deadline=None)
def test_without_motion_everything_stays(seed: int) -> None:
    surface = random_surface(seed)
    found = moved(surface, np.eye(3), np.zeros(3))
    np.testing.assert_allclose(found.inverse_depth, surface.inverse_depth, rtol=1e-9)
    np.testing.assert_allclose(found.sigma, surface.sigma, rtol=1e-6)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("u", [*wall(), plane((0.5, 0.2, 0.8), 5.0)])
def test_a_plane_flows_exactly(seed: int, u: np.ndarray) -> None:
    rotation, translation = relative(ORIGIN, beside(seed))
    expected = of_plane(after(u, rotation, translation))
    found = moved(Surface(of_plane(u), np.full((ROWS, COLUMNS), 0.01)), rotation, translation)
    inner = told_of(CAMERA, rotation, translation, expected)
    assert inner.mean() > 0.3
    np.testing.assert_allclose(found.inverse_depth[inner], expected[inner], rtol=1e-6)


def test_there_and_back_is_no_motion_on_a_plane() -> None:
    rotation, translation = turn(0.05, 0.1, 0.02), np.array([0.3, -0.1, 0.4])
    start = Surface(of_plane(wall()[0]), np.full((ROWS, COLUMNS), 0.01))
    back = moved(moved(start, rotation, translation), rotation.T, -rotation.T @ translation)
    inner = (slice(8, -8), slice(10, -10))
    np.testing.assert_allclose(back.inverse_depth[inner], start.inverse_depth[inner], rtol=1e-6)


def test_a_camera_of_another_size_sees_the_same() -> None:
    half = Camera(np.diag([0.5, 0.5, 1.0]) @ CAMERA.matrix, CAMERA.width // 2, CAMERA.height // 2)
    np.testing.assert_allclose(moved(flat(0.2), np.eye(3), np.zeros(3), to=half).inverse_depth, 0.2, rtol=1e-9)


@given(TURNS, STEPS, st.integers(0, 99))
@settings(max_examples=200, deadline=None)
def test_whatever_the_motion_there_is_a_surface(angles: tuple, step: tuple, seed: int) -> None:
    """Through walls, backwards, upside down: no NaN, nothing negative, and no more sure than before."""
    surface = random_surface(seed)
    found = moved(surface, turn(*angles), np.array(step))
    assert np.isfinite(found.inverse_depth).all()
    assert (found.inverse_depth > 0).all()
    assert (found.sigma >= surface.sigma.min() - 1e-12).all()
    assert (found.sigma <= max(0.3, surface.sigma.max()) + 1e-12).all()


def test_a_camera_that_looks_away_knows_the_median_alone() -> None:
    surface = random_surface(0)
    found = moved(surface, turn(0, np.pi, 0), np.zeros(3))
    np.testing.assert_allclose(found.inverse_depth, np.median(surface.inverse_depth))
    assert (found.sigma == 0.3).all()


def test_who_turns_is_less_sure_the_farther_of_what_comes_into_view() -> None:
    found = moved(flat(0.2, 0.02), turn(0, -0.3, 0), np.zeros(3))
    row = found.sigma[ROWS // 2]
    new = np.flatnonzero(row > 0.07)
    assert 0 < len(new) < COLUMNS
    edge_first = row if row[0] > row[-1] else row[::-1]
    assert (np.diff(edge_first[: len(new)]) <= 1e-12).all()
    assert edge_first[0] > 0.1


def test_the_way_that_the_image_moves_by_makes_less_sure() -> None:
    sigmas = [moved(flat(0.2, 0.02), np.eye(3), (step, 0, 0)).sigma[ROWS // 2, COLUMNS // 2] for step in (0, 0.1, 0.4)]
    assert sigmas[0] == pytest.approx(0.02)
    assert sigmas[0] < sigmas[1] < sigmas[2] < 0.1


def test_many_at_once_are_each_of_them() -> None:
    surfaces = [random_surface(seed) for seed in range(5)]
    rotations = np.array([turn(0.1 * k, -0.05 * k, 0.02 * k) for k in range(5)])
    translations = np.array([(0.2 * k, 0.0, -0.1 * k) for k in range(5)])
    together = flow([Seeing(CAMERA, one) for one in surfaces], rotations, translations, [CAMERA] * 5)
    for k, found in enumerate(together):
        alone = moved(surfaces[k], rotations[k], translations[k])
        np.testing.assert_array_equal(found.inverse_depth, alone.inverse_depth)
        np.testing.assert_array_equal(found.sigma, alone.sigma)
    assert flow([], np.zeros((0, 3, 3)), np.zeros((0, 3)), []) == []


@pytest.mark.parametrize("name", ["arena", "boxes"])
def test_in_a_rendered_world_it_is_closer_to_the_truth_than_a_surface_carried_over(name: str) -> None:
    world, lens = worlds.build(name), pinhole()
    camera = Camera(np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1.0]]), lens.width, lens.height)

    def true(at) -> Surface:
        inverse_depth, _ = cast(sight(world.facets, lens, at), cell_centres(camera))
        return Surface(np.maximum(inverse_depth, 1e-3).reshape(ROWS, COLUMNS), np.full((ROWS, COLUMNS), 0.02))

    def pose(at) -> Pose:
        return Pose(world_from_camera(at), np.array(at.position_m))

    flowed, carried = [], []
    first, *others = worlds.viewpoints(world, 6)
    for at in others:
        x, y, z = at.position_m
        ahead = pose(at).world_from_camera[:, 2]
        yaw, pitch = float(np.arctan2(ahead[1], ahead[0])), float(np.arcsin(ahead[2]))
        here, there = facing((x, y, z), yaw, pitch), facing((x + 0.1, y - 0.1, z), yaw + 0.08, pitch)
        before, now = true(here), true(there)
        motion = relative(pose(here), pose(there))
        watcher, from_watcher = Seeing(camera, true(first)), relative(pose(there), pose(first))
        q = {
            key: seen(Seeing(camera, surface), watcher, *from_watcher, VisibilityOptions()).mean()
            for key, surface in {
                "true": now,
                "flow": moved(before, *motion, camera),
                "carried": Carried(before, camera, *motion).over(camera, SurfaceOptions()),
            }.items()
        }
        flowed.append(abs(q["flow"] - q["true"]))
        carried.append(abs(q["carried"] - q["true"]))
    assert np.mean(flowed) < 0.01
    assert np.mean(flowed) <= np.mean(carried) + 1e-3
