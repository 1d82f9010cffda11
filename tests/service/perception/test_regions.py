import cv2
import numpy as np
import pytest
from covista_service.perception.camera import Camera, Floats
from covista_service.perception.polygon import Polygon, area, rectangle
from covista_service.perception.regions import Mask, RegionOptions, regions
from covista_service.perception.surface import COLUMNS, ROWS, cell_centres

from tests.service.perception.scenes import CAMERA

OPTIONS = RegionOptions()
ALL_CELLS = RegionOptions(least_cells=1)
WIDE = Camera(np.array([[300.0, 0, 320], [0, 300, 100], [0, 0, 1]]), 640, 200)


def empty() -> Mask:
    return np.zeros((ROWS, COLUMNS), np.bool_)


def blobs(seed: int) -> Mask:
    noise = np.random.default_rng(seed).normal(size=(ROWS, COLUMNS))
    return np.asarray(cv2.GaussianBlur(noise, (0, 0), 3.0) > 0.02, np.bool_)


def share(found: list[Polygon], camera: Camera = CAMERA) -> float:
    return sum(map(area, found)) / camera.pixels


def windings(polygon: Polygon, points: Floats) -> np.ndarray:
    """How often a closed line runs round each point, and how often a ray from the point crosses it."""
    corners = np.array(polygon)
    (x0, y0), (x1, y1) = corners.T, np.roll(corners, -1, axis=0).T
    x, y = points[:, :1], points[:, 1:]
    side = (x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)
    down, up = (y0 <= y) & (y < y1) & (side > 0), (y1 <= y) & (y < y0) & (side < 0)
    return np.stack((down.sum(axis=1) - up.sum(axis=1), down.sum(axis=1) + up.sum(axis=1)))


def filled(found: list[Polygon], camera: Camera = CAMERA) -> tuple[Mask, Mask]:
    """Cells whose centres lie in a region, by the nonzero and by the even-odd rule."""
    # A little aside, for borders and seams run through the middles of cells' sides.
    centres = cell_centres(camera) + 1e-3
    nonzero, even_odd = empty().ravel(), empty().ravel()
    for polygon in found:
        rounds, crossings = windings(polygon, centres)
        nonzero |= rounds != 0
        even_odd |= crossings % 2 == 1
    return nonzero.reshape(ROWS, COLUMNS), even_odd.reshape(ROWS, COLUMNS)


@pytest.mark.parametrize("camera", [CAMERA, WIDE])
def test_all_cells_are_the_image(camera: Camera) -> None:
    (region,) = regions(~empty(), camera, OPTIONS)
    assert sorted(region) == sorted(rectangle(camera.width, camera.height))
    assert area(region) == camera.pixels


def test_no_cells_are_no_region() -> None:
    assert regions(empty(), CAMERA, OPTIONS) == []


def test_a_half_is_a_rectangle() -> None:
    mask = empty()
    mask[:, : COLUMNS // 2] = True
    (region,) = regions(mask, CAMERA, OPTIONS)
    assert sorted(region) == sorted(rectangle(CAMERA.width // 2, CAMERA.height))


def test_one_cell_is_a_diamond_or_a_speck() -> None:
    mask = empty()
    mask[7, 9] = True
    assert regions(mask, CAMERA, OPTIONS) == []
    (region,) = regions(mask, CAMERA, ALL_CELLS)
    wide, high = CAMERA.width / COLUMNS, CAMERA.height / ROWS
    assert len(region) == 4
    assert np.mean(region, axis=0) == pytest.approx([9.5 * wide - 0.5, 7.5 * high - 0.5])
    assert area(region) == pytest.approx(wide * high / 2)


def test_two_regions_come_largest_first() -> None:
    mask = empty()
    mask[2:6, 3:9] = mask[20:35, 10:40] = True
    small, large = regions(mask, CAMERA, OPTIONS)[::-1]
    assert 0 < area(small) < area(large)
    assert share([small, large]) == pytest.approx(mask.mean(), abs=0.001)


def test_cells_that_touch_by_a_corner_are_apart() -> None:
    mask = empty()
    mask[5:8, 5:8] = mask[8:11, 8:11] = True
    assert len(regions(mask, CAMERA, OPTIONS)) == 2


def test_holes_are_cut_out() -> None:
    mask = empty()
    mask[4:30, 4:44] = True
    mask[8:12, 8:12] = mask[20:25, 30:37] = mask[14, 14:16] = False
    (region,) = regions(mask, CAMERA, OPTIONS)
    mask[14, 14:16] = True
    assert share([region]) == pytest.approx(mask.mean(), abs=0.001)
    for cells in filled([region]):
        assert (cells == mask).all()


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("camera", [CAMERA, WIDE])
def test_areas_are_the_marked_share(seed: int, camera: Camera) -> None:
    mask = blobs(seed)
    assert share(regions(mask, camera, OPTIONS), camera) == pytest.approx(mask.mean(), abs=0.01)


@pytest.mark.parametrize("density", [0.02, 0.3, 0.5, 0.7, 0.9, 0.98])
@pytest.mark.parametrize("seed", range(4))
def test_whoever_fills_them_gets_the_cells(seed: int, density: float) -> None:
    mask = np.random.default_rng(seed).random((ROWS, COLUMNS)) < density
    found = regions(mask, CAMERA, ALL_CELLS)
    for cells in filled(found):
        assert (cells == mask).all()
    assert all(-0.5 <= x <= CAMERA.width - 0.5 and -0.5 <= y <= CAMERA.height - 0.5 for each in found for x, y in each)


@pytest.mark.parametrize("seed", range(4))
def test_specks_and_pinholes_are_left_out(seed: int) -> None:
    mask = blobs(seed)
    speckled = mask ^ (np.random.default_rng(seed).random(mask.shape) < 0.02)
    found = regions(speckled, CAMERA, OPTIONS)
    cell_px = CAMERA.pixels / mask.size
    assert all(area(region) > (OPTIONS.least_cells - 1) * cell_px for region in found)
