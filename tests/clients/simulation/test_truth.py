from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from covista_clients.simulation import worlds
from covista_clients.simulation.truth import overlap
from covista_clients.simulation.viewing import facing, looking_at, pinhole
from covista_clients.simulation.world import World

from . import oracle

Worlds = Callable[[str], World]
CAMERA = pinhole()


@pytest.mark.parametrize("name", worlds.WORLDS)
def test_overlap_is_what_single_rays_say(world: Worlds, name: str) -> None:
    poses = worlds.viewpoints(world(name), 4, seed=2)
    for a, b in itertools.permutations(poses, 2):
        expected = oracle.overlap(world(name), CAMERA, a, CAMERA, b, step=8)
        # Points in seams, and within rounding of a silhouette, may go either way: a few of 1200.
        assert overlap(world(name), CAMERA, a, CAMERA, b, step=8) == pytest.approx(expected, abs=0.003)


@pytest.mark.parametrize("name", worlds.WORLDS)
def test_a_view_sees_all_of_itself(world: Worlds, name: str) -> None:
    for pose in worlds.viewpoints(world(name), 3):
        assert overlap(world(name), CAMERA, pose, CAMERA, pose) == 1.0


def test_opposite_sides_of_a_wall_have_nothing_in_common(world: Worlds) -> None:
    x, y, half_length, _, yaw = world("arena").courts[0].obstacles[0]
    assert half_length > 1
    across = np.array((-math.sin(yaw), math.cos(yaw))) * 0.6
    a, b = (looking_at((*((x, y) + side * across), 1.0), (x, y, 1.0)) for side in (1, -1))
    narrow = pinhole(320, 240, 40)
    assert overlap(world("arena"), narrow, a, narrow, b) == 0.0
    assert overlap(world("arena"), narrow, b, narrow, a) == 0.0


def test_back_to_back_views_have_nothing_in_common(world: Worlds) -> None:
    a, b = (facing((0.0, -3.0, 1.0), yaw, 0.0) for yaw in (math.pi / 2, -math.pi / 2))
    assert overlap(world("corner"), CAMERA, a, CAMERA, b) == 0.0


def test_views_of_nothing_have_nothing_in_common(world: Worlds) -> None:
    sky = facing((6.0, 6.0, 20.0), 0.0, 1.2)
    assert overlap(world("arena"), CAMERA, sky, CAMERA, sky) == 0.0


@pytest.mark.parametrize("name", ["boxes", "arena"])
def test_a_longer_lens_at_the_same_place_sees_a_part(world: Worlds, name: str) -> None:
    pose = worlds.viewpoints(world(name), 1)[0]
    wide, narrow = pinhole(320, 240, 80), pinhole(320, 240, 40)
    assert overlap(world(name), narrow, pose, wide, pose) == 1.0
    assert overlap(world(name), wide, pose, narrow, pose) < 1.0


def test_a_wall_seen_straight_on_overlaps_by_the_shift(world: Worlds) -> None:
    distance, shift = 2.0, 0.5
    a, b = (facing((x, -distance, 2.6), math.pi / 2, 0.0) for x in (-shift / 2, shift / 2))
    width_m = 2 * distance * math.tan(math.radians(65) / 2)
    q = overlap(world("wall"), CAMERA, a, CAMERA, b, step=1)
    assert q == pytest.approx(1 - shift / width_m, abs=0.01)


@pytest.mark.parametrize("name", ["shelf", "arena"])
def test_fewer_rays_say_about_the_same(world: Worlds, name: str) -> None:
    a, b, *_ = worlds.viewpoints(world(name), 4)
    fine, coarse = (overlap(world(name), CAMERA, a, CAMERA, b, step=step) for step in (2, 4))
    assert coarse == pytest.approx(fine, abs=0.02)
