import warnings

import numpy as np
import pytest
from covista_service.perception.nearest import nearest
from scipy.spatial import KDTree


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("reach", [np.inf, 40.0])
def test_the_same_as_a_tree_tells(seed: int, reach: float) -> None:
    random = np.random.default_rng(seed)
    points = random.uniform((0, 0), (640, 480), (random.integers(1, 900), 2))
    points[: len(points) // 3] = points[0] + random.normal(0, 9, (len(points) // 3, 2))  # a crowd
    places = random.uniform((-200, -200), (900, 700), (300, 2))
    count = min(12, len(points))
    distance, index = nearest(points, places, count, reach)
    expected, same = KDTree(points).query(places, count, distance_upper_bound=reach)
    np.testing.assert_allclose(distance, expected.reshape(distance.shape), atol=1e-9)
    assert (index == same.reshape(index.shape)).all()


def test_of_equals_the_earlier_comes_first() -> None:
    points = np.array([[1.0, 1], [3, 1], [1, 1], [1, 1]])
    _, index = nearest(points, np.array([[1.0, 1.0], [2.0, 1.0]]), 4)
    assert index.tolist() == [[0, 2, 3, 1], [0, 1, 2, 3]]


@pytest.mark.parametrize(
    "points",
    [np.zeros((1, 2)), np.zeros((50, 2)), np.column_stack((np.arange(50.0), np.zeros(50))), np.full((3, 2), 1e6)],
    ids=["one", "fifty in one place", "in line", "far away"],
)
def test_degenerate_points_are_found(points: np.ndarray) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        distance, _ = nearest(points, np.array([[0.0, 0.0], [1e3, -1e3]]), 1)
    gaps = np.linalg.norm(points[None] - np.array([[0.0, 0], [1e3, -1e3]])[:, None], axis=2).min(axis=1)
    np.testing.assert_allclose(distance[:, 0], gaps, rtol=1e-12)


def test_more_than_there_are_is_nobody() -> None:
    distance, index = nearest(np.array([[1.0, 2.0]]), np.array([[1.0, 2.0]]), 3)
    assert distance.tolist() == [[0, np.inf, np.inf]]
    assert index.tolist() == [[0, 1, 1]]
