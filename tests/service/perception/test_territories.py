import numpy as np
from covista_service.perception.territories import Marks, TerritoryOptions, territories

OPTIONS = TerritoryOptions()
# Two planes whose inverse depths are equal at x = 50: left of it the first is nearer.
NEAREST = np.array([[-0.01, 0.0, 1.0], [0.0, 0.0, 0.5]])


def marks(first_is_left: bool) -> Marks:
    random = np.random.default_rng(0)
    left = random.uniform([0, 0], [48, 80], (40, 2))
    right = random.uniform([52, 0], [100, 80], (40, 2))
    owners = np.repeat([0, 1] if first_is_left else [1, 0], 40)
    return Marks(np.vstack((left, right)), owners, NEAREST)


def test_nearest_first_stands_where_the_points_agree() -> None:
    first, second = territories(marks(True), marks(True), OPTIONS)
    assert first is NEAREST
    assert second is NEAREST


def test_where_the_points_contradict_lines_between_them_stand_in() -> None:
    for order in territories(marks(False), marks(False), OPTIONS):
        pixels = np.array([[10.0, 40, 1], [90.0, 40, 1]])
        assert (pixels @ order.T).argmax(axis=1).tolist() == [1, 0]


def test_both_images_follow_one_rule() -> None:
    first, second = territories(marks(True), marks(False), OPTIONS)
    assert (first is NEAREST) == (second is NEAREST)


def test_one_plane_owns_all() -> None:
    alone = Marks(np.array([[3.0, 4.0]]), np.array([0]), np.array([[0.0, 0.0, 1.0]]))
    first, _ = territories(alone, alone, OPTIONS)
    assert first.shape == (1, 3)
