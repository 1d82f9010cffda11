from __future__ import annotations

import threading

import numpy as np
import pytest
from covista_clients.simulation import worlds
from covista_clients.simulation.paths import Paths
from covista_clients.simulation.renderer import render
from covista_clients.simulation.stock import Stock, StockOptions, make
from covista_clients.simulation.viewing import world_from_camera
from covista_schemas import features
from covista_schemas.messages import Pose

from tests.clients.simulation import stocks

OPTIONS = StockOptions(robots=2, world="wall", steps=3, step_s=0.5, features=60, thumbnails=True)


@pytest.fixture(scope="module")
def stock() -> Stock:
    made = make(OPTIONS)
    assert made is not None
    return made


def placed(stock: Stock, robot: int, step: float) -> Pose:
    return Pose(*stock.placed(robot, step))


def test_every_robot_has_a_keyframe_of_every_step(stock: Stock) -> None:
    assert (stock.robots, stock.steps) == (2, 3)
    assert all(0 < len(shot.features) <= 60 for shots in stock.shots for shot in shots)
    assert all(features.decode_image(shot.thumbnail).shape[1] == 96 for shots in stock.shots for shot in shots)


def test_a_keyframe_shows_what_its_pose_sees(stock: Stock) -> None:
    world = worlds.build("wall", 0, 2)
    for robot in range(2):
        for step in range(3):
            seen = features.extract(render(world, stock.camera, placed(stock, robot, step)).image, count=60)
            np.testing.assert_array_equal(stock.shots[robot][step].features.descriptors, seen.descriptors)
            np.testing.assert_array_equal(stock.shots[robot][step].features.keypoints_px, seen.keypoints_px)


def test_poses_between_keyframes_lie_on_the_path(stock: Stock) -> None:
    paths = Paths(worlds.build("wall", 0, 2), 2)
    for step in np.linspace(0, 2, 41).tolist():
        on_path, given = paths.pose(1, step * 0.5), placed(stock, 1, step)
        assert np.linalg.norm(np.subtract(on_path.position_m, given.position_m)) < 1e-3
        np.testing.assert_allclose(world_from_camera(given), world_from_camera(on_path), atol=1e-3)


def test_robots_of_a_court_follow_each_other() -> None:
    made = make(StockOptions(robots=8, steps=1, features=5))
    assert made is not None
    court = [int(made.placed(robot, 0)[0][0] // 12) for robot in range(8)]
    assert court == sorted(court)
    assert set(court) == {0, 1}
    np.testing.assert_allclose(made.upper_m - made.lower_m, [24, 12], atol=1e-9)


def test_robots_do_not_flip_their_quaternions_on_the_way() -> None:
    stock = stocks.drawn()
    orientations = np.array([[turned for _, turned in track] for track in stock.tracks])
    assert (np.einsum("rij,rij->ri", orientations[:, 1:], orientations[:, :-1]) > 0.9).all()


def test_progress_is_told_to_the_last_keyframe() -> None:
    told: list[tuple[int, int]] = []
    make(StockOptions(robots=1, world="wall", steps=3, features=5), on_shot=lambda *counts: told.append(counts))
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_making_ends_when_told() -> None:
    stop = threading.Event()
    made = make(StockOptions(robots=6, world="wall", features=5), stop, lambda *_: stop.set())
    assert made is None
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("stock")]


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"robots": 0}, "1 to 24 robots, not 0"),
        ({"robots": 25}, "1 to 24 robots, not 25"),
        ({"world": "moon"}, "there is no world 'moon'"),
        ({"steps": 0}, "must be positive"),
        ({"features": 0}, "must be positive"),
        ({"step_s": 0.0}, "must be positive"),
        ({"step_s": float("nan")}, "must be positive"),
        ({"step_s": float("inf")}, "must be positive"),
    ],
)
def test_a_stock_that_makes_no_sense_says_why(wrong: dict, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        StockOptions(**wrong)
