from __future__ import annotations

import math

import numpy as np
import pytest
from covista_clients.simulation import truth
from covista_clients.simulation.building import assemble, ground
from covista_clients.simulation.textures import gravel
from covista_clients.simulation.viewing import looking_at, pinhole
from covista_clients.simulation.world import World
from covista_service.evaluation.planted import scene as scenes
from covista_service.evaluation.planted.scene import Hills
from covista_service.evaluation.planted.views import (
    FIELD_OF_VIEW_DEG,
    HALF_WIDTH,
    Views,
    frustum_overlap,
    looking,
    overlap,
    surfaces,
)

FLOOR = scenes.floor()
# Two cells wide and 2 m high: a ridge along y at x = 5.
RIDGE = Hills(np.where(np.abs(np.arange(41) - 20) <= 1, 2.0, 0.0) * np.ones((41, 1)), (-5.0, -5.0))


def from_above(*x_m: float, height_m: float = 2.0) -> Views:
    """Cameras that look straight down, their images' width along x."""
    downwards = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]])
    centres = np.array([(x, 0.0, height_m) for x in x_m])
    return Views(centres, np.repeat(downwards[None], len(centres), axis=0))


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0, 1.5])
def test_cameras_side_by_side_share_what_is_not_shifted_out(share: float) -> None:
    shift = share * 2 * HALF_WIDTH * 2.0
    found = overlap(FLOOR, from_above(0.0, shift))
    assert found[0, 1] == found[1, 0] == pytest.approx(max(0.0, 1 - share), abs=1 / 24)


def test_a_camera_twice_as_high_sees_all_that_the_lower_sees_and_shares_a_quarter() -> None:
    views = Views(np.array([(0.0, 0, 2), (0.0, 0, 4)]), from_above(0.0, 0.0).world_from_camera)
    found = overlap(FLOOR, views)
    assert found[0, 1] == 1.0
    assert found[1, 0] == pytest.approx(0.25, abs=0.03)


def test_oblique_cameras_share_what_the_simulation_says() -> None:
    facets, atlas = assemble([ground((-100.0, -100.0), (100.0, 100.0), gravel)], [], np.random.default_rng(0))
    world = World("floor", 0, facets, atlas, ())
    rng = np.random.default_rng(1)
    eyes = np.column_stack([rng.uniform(0, 4, (6, 2)), rng.uniform(1.8, 2.6, 6)])
    # So steep that all that is seen is near.
    targets = np.column_stack([eyes[:, :2] + rng.uniform(-1.2, 1.2, (6, 2)), np.zeros(6)])
    found = overlap(FLOOR, looking(eyes, targets))
    camera = pinhole(320, 240, FIELD_OF_VIEW_DEG)
    poses = [looking_at(tuple(eye), tuple(target)) for eye, target in zip(eyes.tolist(), targets.tolist(), strict=True)]
    for i, first in enumerate(poses):
        for j, second in enumerate(poses):
            if i != j:
                # Rays stand for cells of 13 x 13 pixels.
                assert found[i, j] == pytest.approx(truth.overlap(world, camera, first, camera, second), abs=0.04)


def test_moving_all_cameras_over_the_floor_changes_nothing() -> None:
    rng = np.random.default_rng(2)
    eyes = np.column_stack([rng.uniform(0, 4, (5, 2)), rng.uniform(1.8, 2.6, 5)])
    targets = np.column_stack([rng.uniform(0, 4, (5, 2)), np.zeros(5)])
    aside = np.array([7.0, -3, 0])
    moved = overlap(FLOOR, looking(eyes + aside, targets + aside))
    assert moved == pytest.approx(overlap(FLOOR, looking(eyes, targets)), abs=1 / 432)


def test_both_sides_of_a_corridor_share_nothing() -> None:
    eyes = np.array([(0.0, -3.0, 1.0), (0.0, -3.0, 1.0)])
    found = overlap(scenes.corridor(6.0), looking(eyes, np.array([(0.0, 0.0, 1.0), (0.0, -6.0, 1.0)])))
    assert found.tolist() == [[1.0, 0.0], [0.0, 1.0]]


def test_level_hills_are_a_floor() -> None:
    views = looking(np.array([(0.0, 0, 2), (1.0, 0.5, 2)]), np.array([(2.0, 2, 0), (2.0, 2, 0)]))
    level = Hills(np.zeros((8, 8)), (0.0, 0.0))
    assert overlap(level, views) == pytest.approx(overlap(FLOOR, views), abs=0.01)


def test_rays_meet_the_hills_where_they_are() -> None:
    hills = scenes.hills(np.random.default_rng(3), 20.0, 0.8, 2.0)
    places = np.array([(4.0, 4.0), (12.0, 9.0)])
    eyes = np.array([(x, y, hills.height_m(x, y) + 3) for x, y in places])
    points, met = surfaces(hills, looking(eyes, eyes + np.array([1.0, 1.0, -1.5])))
    heights = [hills.height_m(x, y) for x, y, _ in points[met]]
    assert met.mean() > 0.5
    assert points[met][:, 2] == pytest.approx(heights, abs=0.01)


def test_a_ridge_hides_what_lies_behind_it() -> None:
    target = (8.0, 5.0, 0.0)
    behind = looking(np.array([(2.0, 5.0, 1.5), (7.0, 5.0, 2.5)]), np.array([target, target]))
    assert overlap(RIDGE, behind)[1, 0] == 0.0
    assert overlap(FLOOR, behind)[1, 0] > 0.5
    assert RIDGE.open(np.array([target]), np.array([12.0, 5.0, 1.5])).all()


def test_the_frustum_is_right_where_the_image_is_parallel_to_the_surface() -> None:
    views = from_above(0.0, 0.7, 1.4)
    assert frustum_overlap(FLOOR, views) == pytest.approx(overlap(FLOOR, views), abs=1e-9)


def test_the_frustum_does_not_know_what_hides() -> None:
    target = (8.0, 5.0, 0.0)
    behind = looking(np.array([(2.0, 5.0, 1.5), (7.0, 5.0, 2.5)]), np.array([target, target]))
    assert frustum_overlap(RIDGE, behind)[1, 0] > 0.1


def test_who_looks_at_the_sky_shares_nothing() -> None:
    up = looking(np.array([(0.0, 0, 2), (0.0, 0, 2)]), np.array([(1.0, 0, 9), (1.0, 0, 0)]))
    found = overlap(FLOOR, up)
    assert found[0, 1] == found[1, 0] == 0.0
    assert np.isfinite(frustum_overlap(FLOOR, up)).all()


def test_cameras_are_upright_and_look_at_their_targets() -> None:
    views = looking(np.array([(1.0, 2, 3)]), np.array([(4.0, 6, 3)]))
    right, down, ahead = views.world_from_camera[0].T
    assert ahead == pytest.approx((0.6, 0.8, 0))
    assert down == pytest.approx((0, 0, -1))
    assert right == pytest.approx((0.8, -0.6, 0))
    assert math.isclose(np.linalg.det(views.world_from_camera[0]), 1.0)
