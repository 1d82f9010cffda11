from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from covista_clients.simulation import worlds
from covista_clients.simulation.lattice import SPACING_M, lattice, nearest_free, place, route
from covista_clients.simulation.paths import SCENE_S, Paths
from covista_clients.simulation.viewing import world_from_camera
from covista_clients.simulation.world import Court, World, to_obstacles_m

Worlds = Callable[[str], World]


def test_paths_depend_on_the_seed_alone(world: Worlds) -> None:
    times = np.arange(0, 100, 3.3)
    forth, back = Paths(world("arena"), 4, 7), Paths(world("arena"), 4, 7)
    there = {(k, t): forth.pose(k, t) for t in times for k in range(4)}
    again = {(k, t): back.pose(k, t) for t in times[::-1] for k in (3, 1, 0, 2)}
    assert there == again
    assert Paths(world("arena"), 4, 8).pose(0, 50) != forth.pose(0, 50)


@pytest.mark.parametrize("name", worlds.WORLDS)
def test_rovers_drive_smoothly_and_around_everything(world: Worlds, name: str) -> None:
    step_s, robots = 0.1, 6
    paths = Paths(world(name), robots, 1)
    poses = [[paths.pose(k, t) for k in range(robots)] for t in np.arange(0, 125, step_s)]
    places = np.array([[pose.position_m for pose in row] for row in poses])
    court = world(name).courts[0]
    assert to_obstacles_m(court, places[..., :2].reshape(-1, 2)).min() > 0.05
    assert (places[..., :2] > court.lower_m - 0.1).all()
    assert (places[..., :2] < court.upper_m + 0.1).all()
    speed = np.linalg.norm(np.diff(places, axis=0), axis=2) / step_s
    assert speed.max() < 2.5
    assert np.abs(np.diff(speed, axis=0)).max() / step_s < 8
    ahead = np.array([[world_from_camera(pose)[:, 2] for pose in row] for row in poses])
    turn = np.degrees(np.arccos(np.clip((ahead[1:] * ahead[:-1]).sum(axis=2), -1, 1))) / step_s
    assert turn.max() < 60


@pytest.mark.parametrize("seed", range(4))
def test_groups_form_split_and_merge_within_two_minutes(world: Worlds, seed: int) -> None:
    paths = Paths(world("arena"), 6, seed)
    counts = [len({paths.watched(k, t) for k in range(6)}) for t in np.arange(0, 120, 1.0)]
    change = np.diff(counts)
    assert 2 <= min(counts) < max(counts) <= 4
    assert (change > 0).any()
    assert (change < 0).any()


def test_who_watches_the_same_sight_faces_it(world: Worlds) -> None:
    paths = Paths(world("arena"), 6, 0)
    for t in (1.0, SCENE_S - 0.1, 3 * SCENE_S - 0.1):
        for k in range(6):
            pose = paths.pose(k, t)
            way = np.array(paths.watched(k, t)) - pose.position_m
            cosine = world_from_camera(pose)[:, 2] @ way / np.linalg.norm(way)
            assert cosine > np.cos(np.radians(25))


def test_a_hundred_rovers_spread_over_as_many_courts_as_they_need() -> None:
    arena = worlds.build("arena", 0, robots=100)
    paths = Paths(arena, 100, 0)
    places = np.array([paths.pose(k, 30.0).position_m for k in range(100)])
    inside = [((places[:, :2] > c.lower_m) & (places[:, :2] < c.upper_m)).all(axis=1).sum() for c in arena.courts]
    assert len(inside) == 17
    assert sum(inside) == 100
    assert max(inside) == 6


@pytest.mark.parametrize("robots", [1, 2, 3])
def test_few_rovers_find_something_to_do(world: Worlds, robots: int) -> None:
    paths = Paths(world("corner"), robots, 0)
    assert len({paths.pose(k, t) for k in range(robots) for t in (0, 30, 60, 90)}) > robots


def test_there_is_no_rover_beyond_the_last(world: Worlds) -> None:
    with pytest.raises(IndexError, match="6 rovers"):
        Paths(world("arena"), 6, 0).pose(6, 0.0)


def test_routes_go_round_a_wall() -> None:
    barrier = np.array([[5.0, 4.0, 0.1, 4.0, 0.0]])
    court = Court(np.zeros(2), np.full(2, 10.0), barrier, np.empty((0, 5)))
    grid = lattice(court)
    start, goal = (nearest_free(grid, np.array(spot)) for spot in ((2.0, 2.0), (8.0, 2.0)))
    way = route(grid, start, goal)
    np.testing.assert_allclose(way[[0, -1]], [place(grid, start), place(grid, goal)])
    assert to_obstacles_m(court, way).min() > 0.05
    assert way[:, 1].max() > 8
    assert np.linalg.norm(np.diff(way, axis=0), axis=1).max() < SPACING_M


def test_routes_to_where_one_stands_and_next_door() -> None:
    grid = lattice(Court(np.zeros(2), np.full(2, 4.0), np.empty((0, 5)), np.empty((0, 5))))
    assert len(route(grid, (3, 3), (3, 3))) == 1
    assert len(route(grid, (3, 3), (4, 3))) == 2


def test_what_is_walled_in_is_not_free() -> None:
    ring = [[5.0, 3.0, 2.2, 0.2, 0.0], [5, 7, 2.2, 0.2, 0], [3, 5, 0.2, 2.2, 0], [7, 5, 0.2, 2.2, 0]]
    grid = lattice(Court(np.zeros(2), np.full(2, 10.0), np.array(ring), np.empty((0, 5))))
    inside = np.linalg.norm(place(grid, nearest_free(grid, np.array((5.0, 5.0)))) - 5)
    assert inside > 2
