from __future__ import annotations

import cv2
import numpy as np
import pytest
from covista_clients.simulation.crowd import GAP_M, Crowd
from covista_clients.simulation.stock import Stock, StockOptions, make
from covista_schemas import codec
from covista_schemas.messages import Features, PoseUpdate
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.clients.simulation import stocks

STOCK = stocks.drawn(robots=6, steps=4, thumbnail=b"\xff\xd8\xff")


def positions_m(crowd: Crowd, step: float = 0.0) -> NDArray[np.float64]:
    return np.array([crowd.pose(robot, step).position_m for robot in range(crowd.robots)])


def squares(one: Features, other: Features) -> NDArray[np.int64]:
    a, b = one.descriptors.astype(np.int64), other.descriptors.astype(np.int64)
    return ((a[:, None] - b[None]) ** 2).sum(axis=2)


@given(robots=st.integers(1, 100), step=st.floats(0, 50))
def test_everyone_has_a_place_within_a_tile_of_its_own_company(robots: int, step: float) -> None:
    crowd = Crowd(STOCK, robots)
    assert len(set(crowd.names)) == robots
    for robot in range(robots):
        east, north = crowd.offset_m(robot)
        x, y, _ = crowd.pose(robot, step).position_m
        assert east <= x <= east + stocks.SIDE_M
        assert north <= y <= north + stocks.SIDE_M


@pytest.mark.parametrize("robots", [1, 6, 7, 50, 1000])
def test_tiles_lie_apart(robots: int) -> None:
    crowd = Crowd(STOCK, robots)
    corners = np.array(sorted({crowd.offset_m(robot) for robot in range(robots)}))
    assert len(corners) == -(-robots // 6)
    between = np.abs(corners[:, None] - corners[None]).max(axis=2) + np.diag(np.full(len(corners), np.inf))
    assert between.min(initial=np.inf) >= stocks.SIDE_M + GAP_M


def test_density_is_the_same_however_many_there_are() -> None:
    def neighbours(robots: int) -> NDArray[np.int64]:
        places = positions_m(Crowd(STOCK, robots))
        return (np.linalg.norm(places[:, None] - places[None], axis=2) < 10).sum(axis=1)

    few, many = neighbours(6), neighbours(996)
    np.testing.assert_array_equal(many.reshape(-1, 6), np.tile(few, (166, 1)))


def test_a_thousand_robots_take_up_a_square() -> None:
    span = np.ptp(positions_m(Crowd(STOCK, 1000)), axis=0)
    assert max(span[:2]) < 1.3 * min(span[:2])


@given(a=st.integers(0, 5), b=st.integers(0, 5), tile=st.integers(0, 9), step=st.integers(0, 9))
def test_descriptors_of_one_tile_are_as_far_apart_as_they_were(a: int, b: int, tile: int, step: int) -> None:
    crowd = Crowd(STOCK, 60)
    here, there = (squares(crowd.features(6 * k + a, step), crowd.features(6 * k + b, step)) for k in (0, tile))
    np.testing.assert_array_equal(here, there)


def test_the_first_tile_sends_what_was_seen() -> None:
    crowd = Crowd(STOCK, 7)
    np.testing.assert_array_equal(crowd.features(2, 1).descriptors, STOCK.shots[2][1].features.descriptors)


def test_no_two_tiles_have_the_same_descriptors() -> None:
    crowd = Crowd(STOCK, 1000)
    seen = {crowd.features(robot, 0).descriptors.tobytes() for robot in range(0, 1000, 6)}
    assert len(seen) == 167


@pytest.fixture(scope="module")
def rendered() -> Stock:
    made = make(StockOptions(robots=2, world="wall", steps=1, features=200))
    assert made is not None
    return made


def test_across_tiles_nothing_matches(rendered: Stock) -> None:
    crowd = Crowd(rendered, 6)

    def matches(one: int, other: int) -> int:
        a, b = (crowd.features(robot, 0).descriptors.astype(np.float32) for robot in (one, other))
        best = cv2.BFMatcher(cv2.NORM_L2).knnMatch(a, b, k=2)
        return sum(first.distance < 0.8 * second.distance for first, second in best)

    assert matches(0, 0) > 100
    # The same picture, in other places.
    assert max(matches(0, 2), matches(0, 4), matches(2, 4)) <= 2


def test_robots_go_there_and_back() -> None:
    crowd = Crowd(STOCK, 8)
    for robot in (1, 7):
        shown = [crowd.features(robot, step).descriptors.tobytes() for step in range(13)]
        assert shown[:7] == [*shown[:4], shown[2], shown[1], shown[0]]
        assert shown[6:] == shown[:7]
        assert crowd.pose(robot, 3.25) == crowd.pose(robot, 2.75)
        assert crowd.pose(robot, 6.5) == crowd.pose(robot, 0.5)


def test_a_keyframe_is_taken_where_its_robot_is() -> None:
    crowd = Crowd(STOCK, 20)
    for robot in (0, 5, 13):
        for step in range(4):
            data = codec.encode_taken(
                PoseUpdate("r1", "b", step, crowd.pose(robot, step, 5)), crowd.picture(robot, step)
            )
            keyframe = codec.decode_keyframe(data)
            x, y, z = STOCK.tracks[robot % 6][step * stocks.BETWEEN][0]
            east, north = crowd.offset_m(robot)
            assert keyframe.pose.position_m == (x + east, y + north, z)
            assert keyframe.pose.time_ns == 5
            assert keyframe.camera == STOCK.camera
            assert keyframe.thumbnail == b"\xff\xd8\xff"
            assert keyframe.features is not None
            np.testing.assert_array_equal(keyframe.features.descriptors, crowd.features(robot, step).descriptors)


def test_a_robot_moves_steadily_between_keyframes() -> None:
    crowd = Crowd(STOCK, 6)
    way = np.array([crowd.pose(3, step).position_m for step in np.linspace(0, 3, 61).tolist()])
    np.testing.assert_allclose(np.diff(way, axis=0), np.tile([0.005, 0, 0], (60, 1)), atol=1e-9)


def test_one_keyframe_is_enough_to_stand_still() -> None:
    crowd = Crowd(stocks.drawn(robots=1, steps=1), 3)
    assert crowd.pose(2, 0.0) == crowd.pose(2, 17.5)


def test_names_are_numbers_from_1_on() -> None:
    assert Crowd(STOCK, 3).names == ("r1", "r2", "r3")
    assert Crowd(STOCK, 2, prefix="b").names == ("b1", "b2")


def test_a_crowd_is_somebody() -> None:
    with pytest.raises(ValueError, match="at least 1 robot, not 0"):
        Crowd(STOCK, 0)
