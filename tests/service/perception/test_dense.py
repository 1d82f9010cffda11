import warnings
from dataclasses import replace

import numpy as np
import pytest
from covista_service.perception.camera import Floats, Pose
from covista_service.perception.dense import DenseOptions, densified
from covista_service.perception.jumps import JumpOptions, mixed
from covista_service.perception.scene import Scene, Settled
from covista_service.perception.surface import Surface

from tests.service.perception.scenes import turn
from tests.service.perception.thumbnails import SLANTED, STEP, scene, thumbnail, truth

OPTIONS = DenseOptions()
POSES = [Pose(turn(0, 0.02 * (k - 1.5), 0), np.array([0.5 * (k - 1.5), 0.15 * (k % 2), 0])) for k in range(4)]
ALL = [(i, j) for i in range(4) for j in range(4) if i != j]


def off(surface: Surface | None, expected: Floats) -> Floats:
    """Relative errors of a surface."""
    assert surface is not None
    return np.asarray(np.abs(surface.inverse_depth / expected - 1))


def overlaps(of: Scene) -> list[tuple[float, float] | None]:
    return [of.overlap(*pair) for pair in ALL]


def test_a_slanted_wall_is_found() -> None:
    known = scene(SLANTED, POSES)
    dense = densified(known, OPTIONS)
    for k, pose in enumerate(POSES):
        assert dense.surfaces[k] is not known.surfaces[k]
        assert np.median(off(dense.surfaces[k], truth(SLANTED, pose))) < 0.02
        assert np.percentile(off(dense.surfaces[k], truth(SLANTED, pose)), 95) < 0.06


def test_a_step_is_found_where_no_point_is() -> None:
    known = scene(STEP, POSES, points=40)
    dense = densified(known, OPTIONS)
    for k, pose in enumerate(POSES):
        expected = truth(STEP, pose)
        wrong_before, wrong = ((off(one.surfaces[k], expected) > 0.15).mean() for one in (known, dense))
        assert wrong < 0.6 * wrong_before


def test_steps_alone_can_be_taken_from_it() -> None:
    known = scene(STEP, POSES, points=40)
    dense = densified(known, OPTIONS)
    both = mixed(known, dense, JumpOptions())
    for k, pose in enumerate(POSES):
        expected = truth(STEP, pose)
        wrong_before, wrong = ((off(one.surfaces[k], expected) > 0.15).mean() for one in (known, both))
        assert wrong < 0.7 * wrong_before
        drawn, plain = both.surfaces[k], known.surfaces[k]
        assert drawn is not None
        assert plain is not None
        assert (drawn.inverse_depth == plain.inverse_depth).any()


def test_where_nothing_jumps_the_mixed_surface_is_the_interpolated_one() -> None:
    known = scene(SLANTED, POSES)
    both = mixed(known, densified(known, OPTIONS), JumpOptions(jump=0.5))
    for one, other in zip(known.surfaces, both.surfaces, strict=True):
        assert one is not None
        assert other is not None
        assert (one.inverse_depth == other.inverse_depth).all()


@pytest.mark.parametrize("grey", [0, 90, 255])
def test_thumbnails_without_texture_change_nothing(grey: int) -> None:
    known = scene(SLANTED, POSES, thumbnails=[np.full((72, 96), grey, np.uint8)] * 4)
    assert densified(known, OPTIONS).surfaces == known.surfaces


def test_one_thumbnail_without_texture_disturbs_nobody() -> None:
    known = scene(
        SLANTED, POSES, thumbnails=[*(thumbnail(SLANTED, pose) for pose in POSES[:3]), np.zeros((72, 96), np.uint8)]
    )
    dense = densified(known, OPTIONS)
    assert dense.surfaces[3] is known.surfaces[3]
    for k in range(3):
        assert np.median(off(dense.surfaces[k], truth(SLANTED, POSES[k]))) < 0.02


def test_a_keyframe_without_thumbnail_keeps_its_surface() -> None:
    known = scene(SLANTED, POSES, thumbnails=[None, *(thumbnail(SLANTED, pose) for pose in POSES[1:])])
    dense = densified(known, OPTIONS)
    assert dense.surfaces[0] is known.surfaces[0]
    assert dense.surfaces[1] is not known.surfaces[1]


@pytest.mark.parametrize("shape", [(1, 1), (4, 96), (5, 5), (72, 3)])
def test_tiny_thumbnails_are_no_error(shape: tuple[int, int]) -> None:
    random = np.random.default_rng(0)
    known = scene(SLANTED, POSES, thumbnails=[random.integers(0, 256, shape, np.uint8) for _ in POSES])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert all(np.isfinite(one).all() for one in overlaps(densified(known, OPTIONS)) if one)


@pytest.mark.parametrize("points", [0, 1, 19])
def test_few_points_give_no_range_to_sweep(points: int) -> None:
    known = scene(SLANTED, POSES, points=points)
    assert densified(known, OPTIONS).surfaces == known.surfaces


def test_one_depth_for_all_points_is_no_error() -> None:
    known = scene(SLANTED, POSES)
    same = [
        replace(one, points=replace(one.points, inverse_depths=np.full(len(one.points), 0.2))) for one in known.settled
    ]
    assert all(one is not None for one in overlaps(densified(replace(known, settled=tuple(same)), OPTIONS)))


def test_pictures_of_something_else_change_nothing() -> None:
    random = np.random.default_rng(0)
    known = scene(STEP, POSES, thumbnails=[random.integers(0, 256, (72, 96), np.uint8) for _ in POSES])
    assert densified(known, OPTIONS).surfaces == known.surfaces


def test_robots_in_one_place_see_the_same() -> None:
    poses = [POSES[0], POSES[0], POSES[2]]
    known = scene(STEP, poses)
    known = replace(known, settled=(known.settled[0], known.settled[0], known.settled[2]))
    dense = densified(known, OPTIONS)
    assert dense.surfaces[0] is not known.surfaces[0]
    assert dense.overlap(0, 1) == (1.0, 1.0)


def test_robots_in_one_place_alone_have_nothing_to_sweep() -> None:
    known = scene(STEP, [POSES[0]] * 3)
    assert densified(known, OPTIONS).surfaces == known.surfaces


def scaled_by(scale: float, one: Settled) -> Settled:
    points, surface = one.points, one.surface
    assert surface is not None
    return Settled(
        Pose(one.pose.world_from_camera, scale * one.pose.centre_m),
        Surface(surface.inverse_depth / scale, surface.sigma),
        replace(points, inverse_depths=points.inverse_depths / scale, sigmas=points.sigmas / scale),
    )


@pytest.mark.parametrize("scale", [0.1, 10.0])
def test_scaling_all_baselines_changes_next_to_nothing(scale: float) -> None:
    known = scene(STEP, POSES)
    scaled = replace(known, settled=tuple(scaled_by(scale, one) for one in known.settled))
    one, other = (overlaps(densified(of, OPTIONS)) for of in (known, scaled))
    assert np.array(one, float) == pytest.approx(np.array(other, float), abs=2e-3)
