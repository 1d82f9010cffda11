import numpy as np
import pytest
from covista_service.perception.camera import Camera, Floats, Pose, relative, relatives
from covista_service.perception.frustum import overlap
from covista_service.perception.surface import COLUMNS, ROWS, Surface, cell_centres, flat
from covista_service.perception.visibility import (
    CLUES,
    SAME_SCALE,
    Gallery,
    Mask,
    Seeing,
    VisibilityOptions,
    looks,
    seen,
    seen_masks,
    seen_shares,
)

from tests.service.perception.scenes import CAMERA, ORIGIN, turn

OPTIONS = VisibilityOptions()
ANY_RATIO = (1e-4, 1e4)
FAR = Seeing(CAMERA, flat(1 / 6, 0.01))


def share(
    first: Seeing,
    second: Seeing,
    first_pose: Pose,
    second_pose: Pose,
    ratios: tuple[float, float] = SAME_SCALE,
) -> float:
    return float(seen(first, second, *relative(first_pose, second_pose), OPTIONS, ratios=ratios).mean())


def at(x: float, y: float = 0.0, z: float = 0.0, rotation: Floats | None = None) -> Pose:
    return Pose(np.eye(3) if rotation is None else rotation, np.array([x, y, z]))


def test_the_same_view_sees_all() -> None:
    assert share(FAR, FAR, ORIGIN, ORIGIN) == 1


def test_back_to_back_sees_nothing() -> None:
    assert share(FAR, FAR, ORIGIN, at(0, rotation=turn(0, np.pi, 0))) == 0


@pytest.mark.parametrize("x", [0.5, 1.5, 3.0])
def test_a_wall_is_seen_as_its_polygon_says(x: float) -> None:
    expected = overlap(CAMERA, ORIGIN, 6.0, CAMERA, at(x), 6.0)[0]
    assert share(FAR, FAR, ORIGIN, at(x)) == pytest.approx(expected, abs=1 / COLUMNS)


@pytest.mark.parametrize("scale", [0.1, 10.0])
def test_scaling_the_baseline_with_the_depths_changes_nothing(scale: float) -> None:
    scaled = Seeing(CAMERA, flat(1 / 6 / scale, 0.01))
    one = seen(FAR, FAR, *relative(ORIGIN, at(1.3)), OPTIONS)
    other = seen(scaled, scaled, *relative(ORIGIN, at(1.3 * scale)), OPTIONS)
    assert (one == other).all()


def test_what_lies_behind_the_other_surface_is_hidden() -> None:
    near = flat(1 / 6, 0.01).inverse_depth.copy()
    near[:, : COLUMNS // 2] = 1 / 2  # something close before the left half of the second camera
    blocked = Seeing(CAMERA, Surface(near, np.full((ROWS, COLUMNS), 0.01)))
    free = share(FAR, FAR, ORIGIN, at(1.0))
    assert share(FAR, blocked, ORIGIN, at(1.0)) < free - 0.3


def test_tiny_baselines_hide_nothing() -> None:
    noisy = Seeing(CAMERA, flat(1 / 4, 0.01))
    assert share(FAR, noisy, ORIGIN, at(0.005)) > 0.97
    assert share(FAR, noisy, ORIGIN, at(1.0)) == 0


def test_unconnected_scales_are_taken_out() -> None:
    other = Seeing(CAMERA, flat(1 / 3, 0.01))
    assert share(FAR, other, ORIGIN, at(1.0)) == 0
    assert share(FAR, other, ORIGIN, at(1.0), ANY_RATIO) > 0.7


def test_a_wall_is_not_taken_for_another_scale() -> None:
    """No more of a ratio is taken out than scales can be off by."""
    near = Seeing(CAMERA, flat(1 / 2, 0.01))
    assert share(FAR, near, ORIGIN, at(1.0), ANY_RATIO) > 0.7
    assert share(FAR, near, ORIGIN, at(1.0), (0.8, 1.25)) == 0


def test_clues_say_what_may_be_wrong() -> None:
    """Two walls that differ by 3 % are apart by so much wherever both see them, and nothing is hidden."""
    nearer = Seeing(CAMERA, flat(1.03 / 6, 0.01))
    pairs, scales = np.array([[0, 1]]), np.array([SAME_SCALE])
    found = looks(Gallery.of((FAR, nearer)), pairs, *relatives([ORIGIN, at(1.0)], pairs), scales, OPTIONS)
    clues = dict(zip(CLUES, found.clues[0], strict=True))
    assert clues["apart"] == pytest.approx(found.shares[0] * (1 - 1 / 1.03), rel=1e-6)
    assert (clues["before"], clues["hidden"]) == (0, 0)
    # A strip of 5 % on each side of the border that the view crosses, its cells counting less towards its end; and
    # of those seen also the strips along the other three borders.
    assert 0.015 < clues["outer_edge"] < 0.035
    assert clues["inner_edge"] > 2 * clues["outer_edge"]


CAMERAS = (CAMERA, Camera(np.array([[300.0, 2.0, 150], [0, 310.0, 130], [0, 0, 1]]), 320, 240))


def hilly(random: np.random.Generator, camera: Camera) -> Seeing:
    """Waves of depth between 2 and 6 m, and a step."""
    x, y = (cell_centres(camera) / camera.width * 6).T
    depth = 4 + np.sin(x * random.uniform(0.5, 2) + random.uniform(0, 6)) + np.cos(y * random.uniform(0.5, 2))
    depth[x > random.uniform(2, 6)] *= 0.8
    inverse_depth = (1 / depth).reshape(ROWS, COLUMNS)
    return Seeing(camera, Surface(inverse_depth, random.uniform(0.01, 0.2, (ROWS, COLUMNS))))


def swarm(seed: int, count: int = 8) -> tuple[list[Seeing], list[Pose], np.ndarray]:
    random = np.random.default_rng(seed)
    seeings = [hilly(random, CAMERAS[k % 2]) for k in range(count)]
    poses = [Pose(turn(*random.normal(0, 0.4, 3)), random.normal(0, 0.7, 3)) for _ in range(count)]
    return seeings, poses, np.array([(i, j) for i in range(count) for j in range(count)])


def bilinear(grid: Floats, x: Floats, y: Floats) -> Floats:
    x, y = np.clip(x, 0, COLUMNS - 1), np.clip(y, 0, ROWS - 1)
    j, i = np.minimum(x.astype(int), COLUMNS - 2), np.minimum(y.astype(int), ROWS - 2)
    x, y = x - j, y - i
    upper, lower = ((1 - x) * grid[i + k, j] + x * grid[i + k, j + 1] for k in (0, 1))
    return np.asarray((1 - y) * upper + y * lower, np.float64)


def by_the_book(
    first: Seeing, second: Seeing, rotation: Floats, translation: Floats, ratios: tuple[float, float]
) -> Mask:
    """Point by point: into the second image, and back from either surface into the first."""
    pixels, size = cell_centres(first.camera), np.array([second.camera.width, second.camera.height])
    rays = np.column_stack((pixels, np.ones(len(pixels)))) @ first.camera.rays_from_pixels.T
    points = rays / first.surface.inverse_depth.reshape(-1, 1) @ rotation.T + translation
    seen = points[:, 2] > 0
    projected = points[seen] @ second.camera.matrix.T
    at = projected[:, :2] / projected[:, 2:] + 0.5
    inside = ((at >= 0) & (at < size)).all(axis=1)
    seen[seen] = inside
    cell = at[inside] * (COLUMNS, ROWS) / size
    here, there = 1 / points[seen, 2], bilinear(second.surface.inverse_depth, *(cell - 0.5).T)
    if ratios == SAME_SCALE:
        nearer = second.camera.rays_from_pixels @ np.column_stack((at[inside] - 0.5, np.ones(len(here)))).T / there
        back = (nearer.T - translation) @ rotation @ first.camera.matrix.T
        parallax = np.linalg.norm(back[:, :2] / back[:, 2:] - pixels[seen], axis=1)
        parallax[back[:, 2] <= 0] = np.inf
        column, row = cell.astype(int).T
        limit = 1 - OPTIONS.tolerance - second.surface.sigma[row, column]
        seen[seen] = (here >= there * limit) | (parallax <= OPTIONS.parallax_px)
    elif len(here):
        ratio = np.clip(np.median(here / there), *ratios)
        seen[seen] = here >= there * ratio * (1 - OPTIONS.unconnected_tolerance)
    return seen.reshape(ROWS, COLUMNS) & (sides(first, -rotation.T @ translation) >= -OPTIONS.beyond)


def sides(first: Seeing, centre: Floats) -> Floats:
    """1 + u . C2 of the plane u . X + 1 = 0 that the surface has at each cell: negative beyond it."""
    rho, camera = first.surface.inverse_depth, first.camera
    columns, rows = np.arange(COLUMNS), np.arange(ROWS)
    left, right = np.maximum(columns - 2, 0), np.minimum(columns + 2, COLUMNS - 1)
    upper, lower = np.maximum(rows - 2, 0), np.minimum(rows + 2, ROWS - 1)
    by_x = (rho[:, right] - rho[:, left]) / (right - left) * COLUMNS / camera.width
    by_y = (rho[lower] - rho[upper]) / (lower - upper)[:, None] * ROWS / camera.height
    x, y = (axis.reshape(ROWS, COLUMNS) for axis in cell_centres(camera).T)
    # rho = (by_x, by_y, d) . v = -u . K^-1 v
    u = -np.stack((by_x, by_y, rho - by_x * x - by_y * y), axis=-1) @ camera.matrix
    return 1 + u @ centre


@pytest.mark.parametrize("seed", range(3))
def test_many_pairs_at_once_are_the_same_as_each_alone(seed: int) -> None:
    seeings, poses, pairs = swarm(seed)
    kinds = np.array([SAME_SCALE, ANY_RATIO, (0.9, 1.2)])
    ratios = kinds[np.random.default_rng(seed).integers(0, 3, len(pairs))]
    found = (Gallery.of(seeings), pairs, *relatives(poses, pairs), ratios, OPTIONS)
    shares, masks = seen_shares(*found), seen_masks(*found)
    assert (shares == masks.mean(axis=(1, 2))).all()
    assert (shares == looks(*found).shares).all()
    assert 0 < shares.mean() < 1
    for k, (i, j) in enumerate(pairs):
        alone = seen(seeings[i], seeings[j], found[2][k], found[3][k], OPTIONS, ratios=tuple(ratios[k]))
        assert (masks[k] == alone).all()


@pytest.mark.parametrize("ratios", [SAME_SCALE, ANY_RATIO, (0.9, 1.2)])
def test_cells_are_seen_as_point_by_point(ratios: tuple[float, float]) -> None:
    seeings, poses, pairs = swarm(7)
    found = relatives(poses, pairs)
    masks = seen_masks(Gallery.of(seeings), pairs, *found, np.full((len(pairs), 2), ratios), OPTIONS)
    for mask, (i, j), rotation, translation in zip(masks, pairs, *found, strict=True):
        # A point on the border of an image or of a tolerance may be rounded to either side.
        assert (mask != by_the_book(seeings[i], seeings[j], rotation, translation, ratios)).sum() <= 1


def test_no_pairs_have_no_shares() -> None:
    seeings, poses, _ = swarm(0, 2)
    none = np.zeros((0, 2), np.intp)
    found = (Gallery.of(seeings), none, *relatives(poses, none), np.zeros((0, 2)), OPTIONS)
    assert seen_shares(*found).shape == (0,)
    assert seen_masks(*found).shape == (0, ROWS, COLUMNS)
