from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from covista_clients.simulation import worlds
from covista_clients.simulation.atlas import GUTTER_PX, LEVELS, lay_out
from covista_clients.simulation.textures import concrete, gravel, painted, planks, rubble
from covista_clients.simulation.world import Court, World, clearance_m, to_obstacles_m

Worlds = Callable[[str], World]


@pytest.mark.parametrize("name", worlds.WORLDS)
def test_facets_are_rectangles_within_bounded_memory(world: Worlds, name: str) -> None:
    facets = world(name).facets
    for axis in (facets.right, facets.down, facets.normal):
        np.testing.assert_allclose(np.linalg.norm(axis, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose((facets.right * facets.down).sum(axis=1), 0, atol=1e-12)
    np.testing.assert_allclose(np.cross(facets.down, facets.right), facets.normal, atol=1e-12)
    assert (facets.extent_m > 0).all()
    assert world(name).atlas.image.nbytes < 100e6


def test_the_same_seed_gives_the_same_world(world: Worlds) -> None:
    again = worlds.build("wall", 0)
    np.testing.assert_array_equal(again.facets.corner_m, world("wall").facets.corner_m)
    np.testing.assert_array_equal(again.atlas.image, world("wall").atlas.image)


def test_another_seed_gives_another_world(world: Worlds) -> None:
    other = worlds.build("wall", 1)
    assert not np.array_equal(other.facets.corner_m, world("wall").facets.corner_m)
    assert not np.array_equal(other.atlas.image[:200, :200], world("wall").atlas.image[:200, :200])


def test_unknown_worlds_are_named() -> None:
    with pytest.raises(ValueError, match=r"'moon'.*corner, boxes, shelf, wall, arena"):
        worlds.build("moon")


def test_the_arena_grows_with_its_robots_at_bounded_memory() -> None:
    arena = worlds.build("arena", 0, robots=200)
    assert len(arena.courts) == 34
    assert arena.atlas.image.nbytes < 150e6
    lowest = {tuple(court.lower_m) for court in arena.courts}
    assert len(lowest) == 34


@pytest.mark.parametrize("name", worlds.WORLDS)
def test_viewpoints_stand_free_and_do_not_change(world: Worlds, name: str) -> None:
    poses = worlds.viewpoints(world(name), 7, seed=3)
    assert poses == worlds.viewpoints(world(name), 7, seed=3)
    assert poses != worlds.viewpoints(world(name), 7, seed=4)
    places = np.array([pose.position_m[:2] for pose in poses])
    assert clearance_m(world(name).courts[0], places).min() > 0.3


def test_distance_to_a_turned_obstacle() -> None:
    court = Court(np.zeros(2), np.full(2, 10.0), np.array([[5.0, 5, 2, 1, np.pi / 2]]), np.empty((0, 5)))
    points = np.array([[5.0, 5], [7, 5], [5, 8], [7, 8], [5, 6.5]])
    np.testing.assert_allclose(to_obstacles_m(court, points), [-1, 1, 1, np.sqrt(2), -0.5], atol=1e-12)


@pytest.mark.parametrize("material", [rubble, gravel, concrete, planks, painted])
@pytest.mark.parametrize("shape", [(30, 30), (40, 400), (300, 31)])
def test_materials_fill_any_patch_with_contrast(material: Callable[..., np.ndarray], shape: tuple[int, int]) -> None:
    picture = material(np.random.default_rng(0), *shape, 150.0, 0.4)
    assert picture.shape == (*shape, 3)
    assert picture.dtype == np.uint8
    assert picture.std() > 8


def test_patches_have_room_of_their_own() -> None:
    extent = np.random.default_rng(0).uniform(0.05, 3, (40, 2))
    layout = lay_out(extent, 100.0)
    taken = np.zeros((layout.height, layout.width), int)
    for slot, size in zip(layout.slots(), extent, strict=True):
        assert taken[slot].shape == tuple(np.ceil(size[::-1] * 100).astype(int) + 2 * GUTTER_PX)
        taken[slot] += 1
    assert taken.max() == 1


def test_mip_levels_are_means(world: Worlds) -> None:
    atlas = world("corner").atlas
    height, width = atlas.image.shape[0], int(atlas.level_px[1, 0])
    base = atlas.image[:, :width, 0].astype(np.float32)
    for level in (1, 2, LEVELS - 1):
        x, y = atlas.level_px[level].astype(int)
        size = 2**level
        small = atlas.image[y : y + height // size, x : x + width // size, 0]
        mean = base.reshape(height // size, size, width // size, size).mean(axis=(1, 3))
        # Every level rounds once.
        assert np.abs(mean - small).max() <= 0.51 * level + 0.5
