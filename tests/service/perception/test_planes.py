import numpy as np
import pytest
from covista_service.perception.camera import Floats, relative
from covista_service.perception.description import length
from covista_service.perception.fuzzy import Points, fit, merged, most_similar, noise_memberships
from covista_service.perception.planes import FoundPlanes, PlaneOptions, find_planes, neighbours, terms_of
from covista_service.perception.triangulation import TriangulationOptions, triangulate

from tests.service.perception.scenes import ORIGIN, Scene, beside, corner, plane, scene, wall

OPTIONS = PlaneOptions()
FLOOR_AND_WALL = np.array([plane((0, 1, 0), 1.5), plane((0.1, 0, 1), 6)])


def cloud(made: Scene) -> tuple[Points, np.ndarray]:
    """Triangulated points of a scene, and the plane of each."""
    found = triangulate(made.sightings(), *relative(ORIGIN, made.second.pose), TriangulationOptions(4.0))
    kept = found.only(found.kept)
    return Points(kept.rays, kept.inverse_depths, kept.shifts_px), made.owners[found.kept]


def recovered(found: FoundPlanes, points: Points, owners: np.ndarray, planes: Floats) -> bool:
    """Does each true plane have one found plane that most of its points lie near?"""
    if not len(found.normals):
        return False
    away = points.distances(found.coefficients)
    seen = [k for k in range(len(planes)) if (owners == k).sum() >= 12]
    return all(np.median(away[owners == k], axis=0).min() < 1.5 for k in seen)


@pytest.mark.parametrize(
    ("planes", "outliers", "least"),
    [(wall(), 0.2, 1.0), (wall(), 0.4, 1.0), (FLOOR_AND_WALL, 0.4, 0.9), (corner(), 0.2, 0.85), (corner(), 0.4, 0.7)],
)
def test_planes_are_found_among_outliers(planes: Floats, outliers: float, least: float) -> None:
    successes = []
    for seed in range(16):
        points, owners = cloud(scene(planes, beside(seed), 220, 0.5, outliers, seed))
        successes.append(recovered(find_planes(points, OPTIONS, 0), points, owners, planes))
    assert np.mean(successes) >= least


@pytest.mark.parametrize("planes", [wall(), FLOOR_AND_WALL, corner()], ids=["wall", "floor and wall", "corner"])
def test_no_more_planes_are_found_than_there_are(planes: Floats) -> None:
    right = []
    for seed in range(16):
        points, owners = cloud(scene(planes, beside(seed), 220, 0.5, 0.2, seed))
        seen = sum((owners == k).sum() >= 12 for k in range(len(planes)))
        right.append(len(find_planes(points, OPTIONS, 0).normals) <= seen)
    assert np.mean(right) >= 0.8


def test_the_length_of_the_baseline_scales_the_planes_and_nothing_else() -> None:
    points, _ = cloud(scene(corner(), beside(), 220, 0.5, 0.2))
    one = find_planes(points, OPTIONS, 0)
    for w in (0.1, 10.0):
        scaled = find_planes(Points(points.rays, points.inverse_depths / w, points.shifts_px * w), OPTIONS, 0)
        np.testing.assert_array_equal(scaled.labels, one.labels)
        np.testing.assert_allclose(scaled.coefficients * w, one.coefficients, rtol=1e-9, atol=1e-12)


def test_known_planes_are_kept_where_they_still_fit() -> None:
    points, owners = cloud(scene(corner(), beside(), 220, 0.5, 0.2))
    found = find_planes(points, PlaneOptions(restarts=0), 0, -corner())
    assert recovered(found, points, owners, corner())


def test_points_all_over_the_place_are_no_plane_and_hurt_nobody() -> None:
    random = np.random.default_rng(0)
    rays = np.column_stack((random.uniform(-0.6, 0.6, (40, 2)), np.ones(40)))
    found = find_planes(Points(rays, random.uniform(0.01, 2, 40), np.full(40, 300.0)), OPTIONS, 0)
    assert (found.labels >= 0).mean() < 0.5


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_few_points_are_no_plane(count: int) -> None:
    points = Points(np.ones((count, 3)), np.ones(count), np.ones(count))
    found = find_planes(points, OPTIONS, 0)
    assert found.normals.shape == (0, 3)
    assert (found.labels == -1).all()


def test_points_in_line_or_all_at_one_place_are_no_plane() -> None:
    along = np.linspace(-0.5, 0.5, 40)
    line = np.column_stack((along, 0.3 * along, np.ones(40)))
    for rays in (line, np.ones((40, 3))):
        assert not len(find_planes(Points(rays, np.full(40, 0.2), np.full(40, 300.0)), OPTIONS, 0).normals)


def test_a_fit_goes_through_exact_points() -> None:
    random = np.random.default_rng(3)
    rays = np.column_stack((random.uniform(-0.5, 0.5, (30, 2)), np.ones(30)))
    truth = np.array([0.1, -0.05, 0.2])
    points = Points(rays, rays @ truth, random.uniform(100, 300, 30))
    np.testing.assert_allclose(fit(points.cloud, random.random((1, 30)))[0], truth, atol=1e-7)


def test_memberships_and_the_outliers_share_make_one() -> None:
    off_px = np.array([2.0, 1e6, 0.0])
    cloud = np.array([[0.0, 0.1, 0.2], [0.0, 0.3, 0.1], off_px / 100, [100.0, 100.0, 100.0]])
    planes = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1e6]])
    memberships = noise_memberships(cloud, planes, 0.5, 2.0)
    np.testing.assert_allclose(memberships.sum(axis=0), [0.5, 0.0, 0.8], atol=1e-6)


def test_two_clusters_can_become_one_and_strangers_stay_apart() -> None:
    alike = np.full((2, 20), 0.5)
    assert most_similar(alike) == (0, 1)
    np.testing.assert_allclose(merged(alike, 0, 1), 1.0)
    assert most_similar(np.repeat(np.eye(2), 10, axis=1)) == (-1, -1)
    assert most_similar(np.ones((1, 5))) == (-1, -1)


def test_merging_leaves_the_others_as_they_are() -> None:
    memberships = np.random.default_rng(0).random((4, 7))
    rest = merged(memberships, 1, 2)
    np.testing.assert_array_equal(rest, [memberships[0], memberships[1] + memberships[2], memberships[3]])


def test_a_true_plane_shortens_the_description() -> None:
    points, _ = cloud(scene(wall(), beside(), 200, 0.5, 0.2))
    none, true, twice = np.zeros((0, 3)), -wall(), np.vstack((-wall(), -wall()))
    beside_each = neighbours(points, OPTIONS.neighbours)
    lengths = [length(points.cloud, beside_each, one, terms_of(1.0, OPTIONS)) for one in (none, true, twice)]
    assert lengths[1] < min(lengths[0], lengths[2])


def test_a_plane_of_scattered_points_is_dearer_than_one_of_neighbours() -> None:
    random = np.random.default_rng(0)
    place = random.uniform(-0.5, 0.5, (2, 200))
    left, scattered = place[0] < 0, random.random(200) < 0.5
    lengths = []
    for on_one in (left, scattered):
        rho = np.where(on_one, 0.2, 0.4)
        points = Points(np.column_stack((*place, np.ones(200))), rho, np.full(200, 300.0))
        planes = np.array([[0, 0, 0.2], [0, 0, 0.4]])
        lengths.append(length(points.cloud, neighbours(points, 8), planes, terms_of(1.0, OPTIONS)))
    assert lengths[0] < lengths[1] - 50
