import numpy as np
import pytest
from covista_service.perception import polygon


def test_an_image_has_as_much_area_as_pixels() -> None:
    assert polygon.area(polygon.rectangle(640, 480)) == 640 * 480


def test_a_cut_and_its_opposite_share_the_area() -> None:
    random = np.random.default_rng(1)
    image = polygon.rectangle(64, 48)
    for _ in range(200):
        a, b = random.normal(size=2)
        x, y = random.uniform(-20, 80, 2)
        line = [a, b, -a * x - b * y]
        both = polygon.area(polygon.cut(image, [line])) + polygon.area(polygon.cut(image, [[-v for v in line]]))
        assert both == pytest.approx(64 * 48)


def test_nothing_is_left_beyond_a_line_and_of_nothing() -> None:
    assert polygon.cut(polygon.rectangle(64, 48), [[1, 0, -100], [0, 1, 0]]) == []
    assert polygon.area([]) == 0.0
    assert polygon.mapped([], np.eye(3)) == []
    assert polygon.corners([]).shape == (0, 2)


def test_mapping_there_and_back() -> None:
    homography = np.array([[1.1, 0.1, 3], [-0.05, 0.9, 2], [1e-4, 2e-4, 1]])
    image = polygon.rectangle(64, 48)
    back = polygon.mapped(polygon.mapped(image, homography), np.linalg.inv(homography))
    np.testing.assert_allclose(back, image, atol=1e-9)
