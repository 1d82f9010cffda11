import numpy as np
import pytest
from covista_service.perception.camera import Camera, Floats, Pose, relative
from covista_service.perception.overlap import common_field

from tests.service.perception.scenes import CAMERA, ORIGIN, beside, corner, plane, turn, wall

SMALL = Camera(np.array([[120.0, 0, 60.0], [0, 110.0, 50.0], [0, 0, 1]]), 128, 96)
OTHER = Camera(np.array([[90.0, 0, 70.0], [0, 95.0, 44.0], [0, 0, 1]]), 140, 100)


def nearest(rays: Floats, centre: Floats, planes: Floats) -> tuple[np.ndarray, Floats]:
    """The first plane that rays (n, 3) from a centre hit, -1 for none, and the points (n, 3)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = -(1 + planes @ centre) / (rays @ planes.T)
    reach = np.where(np.isfinite(reach) & (reach > 1e-9), reach, np.inf)
    hit = reach.argmin(axis=1)
    shortest = reach.min(axis=1)
    found = np.isfinite(shortest)
    return np.where(found, hit, -1), centre + rays * np.where(found, shortest, 0.0)[:, None]


def cast(first: Camera, one: Pose, second: Camera, two: Pose, planes: Floats, random: np.random.Generator) -> float:
    """Share of the first image whose first hit is the second camera's first hit too; planes in the world.

    A ray goes through some point of every cell of a grid: through the centres, a border along a row would err all one
    way.
    """
    x, y = np.meshgrid(np.arange(96), np.arange(72))
    x = (x + random.random(x.shape)) * first.width / 96 - 0.5
    y = (y + random.random(y.shape)) * first.height / 72 - 0.5
    pixels = np.column_stack((x.ravel(), y.ravel(), np.ones(x.size)))
    owner, points = nearest(pixels @ np.linalg.inv(first.matrix).T @ one.world_from_camera.T, one.centre_m, planes)
    seen = (points - two.centre_m) @ two.world_from_camera
    ahead = (owner >= 0) & (seen[:, 2] > 1e-9)
    v = seen @ second.matrix.T / np.where(ahead, seen[:, 2], 1.0)[:, None]
    inside = (v[:, 0] >= -0.5) & (v[:, 0] < second.width - 0.5) & (v[:, 1] >= -0.5) & (v[:, 1] < second.height - 0.5)
    there, _ = nearest(points - two.centre_m, two.centre_m, planes)
    sides = np.sign(1 + planes @ one.centre_m) == np.sign(1 + planes @ two.centre_m)
    return float((ahead & inside & (there == owner) & sides[owner]).mean())


def random_scene(random: np.random.Generator) -> tuple[Pose, Floats]:
    """A second camera, and planes that leave the first one (at the origin) on their inner side."""
    planes = []
    for _ in range(random.integers(1, 5)):
        normal = random.normal(size=3) * [1, 1, 1.5]
        planes.append(plane(tuple(normal * np.sign(normal[2])), random.uniform(2, 8)))
    return Pose(turn(*random.normal(0, 0.4, 3)), random.normal(0, 0.8, 3)), np.array(planes)


def test_areas_agree_with_ray_casting() -> None:
    random = np.random.default_rng(0)
    gaps = []
    for _ in range(400):
        pose, planes = random_scene(random)
        field = common_field(SMALL, OTHER, *relative(ORIGIN, pose), planes)
        gaps.append(abs(field.overlap_first - cast(SMALL, ORIGIN, OTHER, pose, planes, random)))
        gaps.append(abs(field.overlap_second - cast(OTHER, pose, SMALL, ORIGIN, planes, random)))
    assert max(gaps) <= 0.003
    assert np.mean(gaps) < 0.0006


def test_the_length_of_the_baseline_does_not_matter() -> None:
    rotation, translation = relative(ORIGIN, beside(3))
    one = common_field(CAMERA, CAMERA, rotation, translation, corner())
    for w in (0.1, 0.5, 2.0, 10.0):
        scaled = common_field(CAMERA, CAMERA, rotation, w * translation, corner() / w)
        assert scaled.overlap_first == pytest.approx(one.overlap_first, abs=1e-9)
        assert scaled.overlap_second == pytest.approx(one.overlap_second, abs=1e-9)


def test_swapping_the_cameras_swaps_the_shares() -> None:
    random = np.random.default_rng(5)
    for _ in range(30):
        pose, planes = random_scene(random)
        rotation, translation = relative(ORIGIN, pose)
        facing = 1 + planes @ pose.centre_m > 1e-3
        there = common_field(SMALL, OTHER, rotation, translation, planes[facing])
        moved = planes[facing] @ rotation.T / (1 + planes[facing] @ pose.centre_m)[:, None]
        back = common_field(OTHER, SMALL, rotation.T, -rotation.T @ translation, moved)
        assert back.overlap_first == pytest.approx(there.overlap_second, abs=1e-9)
        assert back.overlap_second == pytest.approx(there.overlap_first, abs=1e-9)


def test_moving_the_world_frame_changes_nothing() -> None:
    random = np.random.default_rng(6)
    world, away = turn(0.4, -1.0, 2.0), np.array([30.0, -20.0, 10.0])
    for _ in range(30):
        pose, planes = random_scene(random)
        moved = [Pose(world @ one.world_from_camera, world @ one.centre_m + away) for one in (ORIGIN, pose)]
        here = common_field(SMALL, OTHER, *relative(ORIGIN, pose), planes)
        there = common_field(SMALL, OTHER, *relative(*moved), planes)
        assert there.overlap_first == pytest.approx(here.overlap_first, abs=1e-9)
        assert there.overlap_second == pytest.approx(here.overlap_second, abs=1e-9)


def test_the_same_view_has_everything_in_common() -> None:
    for planes in (wall(), corner()):
        field = common_field(CAMERA, CAMERA, np.eye(3), np.zeros(3), planes)
        assert field.overlap_first == pytest.approx(1.0, abs=1e-12)
        assert field.overlap_second == pytest.approx(1.0, abs=1e-12)


def test_opposite_sides_of_a_wall_have_nothing_in_common() -> None:
    behind = Pose(turn(0, np.pi, 0), np.array([0.0, 0.0, 12.0]))
    field = common_field(CAMERA, CAMERA, *relative(ORIGIN, behind), wall())
    assert (field.overlap_first, field.overlap_second) == (0.0, 0.0)


def test_a_camera_within_the_plane_sees_nothing_of_it() -> None:
    within = Pose(np.eye(3), np.array([0.0, 0.0, 6.0]))
    field = common_field(CAMERA, CAMERA, *relative(ORIGIN, within), np.array([plane((0, 0, 1), 6.0)]))
    assert (field.overlap_first, field.overlap_second) == (0.0, 0.0)


def test_a_floor_is_seen_below_the_horizon_only() -> None:
    field = common_field(CAMERA, CAMERA, np.eye(3), np.zeros(3), np.array([plane((0, 1, 0), 1.0)]))
    assert field.overlap_first == pytest.approx(0.5, abs=1e-9)


def test_regions_lie_in_both_images_and_correspond() -> None:
    field = common_field(SMALL, OTHER, *relative(ORIGIN, beside(1)), corner())
    for region in field.regions_first:
        assert np.all(np.array(region).reshape(-1, 2) <= [127.5 + 1e-9, 95.5 + 1e-9])
    for first, second in zip(field.regions_first, field.regions_second, strict=True):
        assert len(first) == len(second)
