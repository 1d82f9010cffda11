import numpy as np
from covista_service.perception.camera import Floats
from covista_service.perception.neighbours import NeighbourOptions, best_neighbours
from covista_service.perception.surface import flat
from covista_service.perception.visibility import Seeing

from tests.service.perception.scenes import CAMERA, turn

HERE = Seeing(CAMERA, flat(0.2, sigma=0.0))
OPTIONS = NeighbourOptions()


def beside(x_m: float) -> tuple[Seeing, Floats, Floats]:
    return HERE, np.eye(3), np.array([-x_m, 0, 0])


def test_much_in_common_and_some_parallax_come_first() -> None:
    assert best_neighbours(HERE, [beside(3), beside(1), beside(0.1)], OPTIONS) == [1, 0, 2]


def test_no_more_than_asked_for() -> None:
    assert best_neighbours(HERE, [beside(1)] * 5, NeighbourOptions(count=2)) == [0, 1]


def test_one_in_the_same_place_is_of_no_use() -> None:
    turned = HERE, turn(0, 0.2, 0), np.zeros(3)
    assert best_neighbours(HERE, [beside(0), turned, beside(0.001)], OPTIONS) == []


def test_one_that_sees_something_else_is_of_no_use() -> None:
    away = HERE, turn(0, np.pi, 0), np.array([1.0, 0, 0])
    assert best_neighbours(HERE, [beside(30), away], OPTIONS) == []


def test_there_may_be_none() -> None:
    assert best_neighbours(HERE, [], OPTIONS) == []
