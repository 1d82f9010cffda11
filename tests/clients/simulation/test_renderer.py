from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np
import pytest
from covista_clients.simulation import worlds
from covista_clients.simulation.renderer import render
from covista_clients.simulation.sight import cast, sight
from covista_clients.simulation.truth import lifted, pixels
from covista_clients.simulation.viewing import facing, pinhole, world_from_camera
from covista_clients.simulation.world import World
from covista_schemas.features import extract
from covista_schemas.messages import Camera, Pose

from .oracle import first_hit, rays

Worlds = Callable[[str], World]
CAMERA = pinhole()


@pytest.mark.parametrize("name", worlds.WORLDS)
def test_depth_is_where_single_rays_end(world: Worlds, name: str) -> None:
    for pose in worlds.viewpoints(world(name), 3, seed=1):
        points = pixels(CAMERA, 7)
        depth = first_hit(world(name), np.array(pose.position_m), rays(CAMERA, pose, points))
        rendered = render(world(name), CAMERA, pose).depth_m[points[:, 1].astype(int), points[:, 0].astype(int)]
        # A ray along an edge may fall to either side of it.
        agree = np.isclose(rendered, np.where(np.isfinite(depth), depth, 0), rtol=1e-4)
        assert agree.mean() > 0.998


@pytest.mark.parametrize("name", worlds.WORLDS)
def test_pictures_are_full_of_features(world: Worlds, name: str) -> None:
    counts = [len(extract(render(world(name), CAMERA, pose).image)) for pose in worlds.viewpoints(world(name), 5)]
    assert np.median(counts) >= 400
    assert min(counts) >= 200


@pytest.mark.parametrize("name", worlds.WORLDS)
def test_features_are_found_again_where_the_surface_went(world: Worlds, name: str) -> None:
    pose, _ = worlds.viewpoints(world(name), 2)
    x, y, z = pose.position_m
    other = Pose((x + 0.3, y, z), pose.orientation_xyzw)
    found = _matched(render(world(name), CAMERA, pose).image, render(world(name), CAMERA, other).image)
    here, there = found
    inverse_depth, _ = cast(sight(world(name).facets, CAMERA, pose), here)
    surface = lifted(CAMERA, pose, here, np.maximum(inverse_depth, 1e-3))
    expected = _projected(CAMERA, other, surface)
    error = np.linalg.norm(expected - there, axis=1)
    assert len(error) > 100
    assert np.median(error) < 0.3
    assert (error < 2).mean() > 0.85


def test_a_surface_has_the_same_colour_in_every_view(world: Worlds) -> None:
    pose, other = worlds.viewpoints(world("wall"), 2)
    other = Pose((pose.position_m[0] + 0.4, pose.position_m[1] - 0.3, pose.position_m[2]), pose.orientation_xyzw)
    first, second = (render(world("wall"), CAMERA, p) for p in (pose, other))
    points = pixels(CAMERA, 1)
    surface = lifted(CAMERA, pose, points, 1 / np.maximum(first.depth_m.ravel(), 1e-3))
    place = _projected(CAMERA, other, surface).astype(np.float32).reshape(CAMERA.height, CAMERA.width, 2)
    warped = cv2.remap(second.image, place[..., 0], place[..., 1], cv2.INTER_LINEAR)
    inside = (place >= 0).all(axis=2) & (place <= (CAMERA.width - 1, CAMERA.height - 1)).all(axis=2)
    assert inside.mean() > 0.5
    assert np.corrcoef(first.image[inside].ravel(), warped[inside].ravel())[0, 1] > 0.9


def test_the_same_view_gives_the_same_bytes(world: Worlds) -> None:
    pose = worlds.viewpoints(world("arena"), 1)[0]
    first, again = (render(world("arena"), CAMERA, pose) for _ in range(2))
    np.testing.assert_array_equal(first.image, again.image)
    np.testing.assert_array_equal(first.depth_m, again.depth_m)


def test_nothing_but_sky_has_no_depth_and_no_features(world: Worlds) -> None:
    rendering = render(world("arena"), CAMERA, facing((6.0, 6.0, 1.0), 0.0, math.radians(85)))
    up = render(world("arena"), CAMERA, facing((6.0, 6.0, 9.0), 0.0, math.radians(60)))
    assert up.depth_m.max() == 0
    assert len(extract(up.image)) == 0
    assert rendering.image.shape == (240, 320, 3)


def test_a_cropped_camera_sees_a_part_of_the_same_depth(world: Worlds) -> None:
    pose = worlds.viewpoints(world("shelf"), 1)[0]
    whole = render(world("shelf"), CAMERA, pose).depth_m
    part = Camera(fx=CAMERA.fx, fy=CAMERA.fy, cx=CAMERA.cx - 40, cy=CAMERA.cy - 30, width=100, height=80)
    np.testing.assert_allclose(render(world("shelf"), part, pose).depth_m, whole[30:110, 40:140], rtol=1e-5)


def test_a_camera_beside_a_wall_sees_it_through_the_near_plane(world: Worlds) -> None:
    rendering = render(world("wall"), CAMERA, facing((0.0, -0.15, 1.0), 0.0, 0.0))
    assert 0.4 < (rendering.depth_m > 0).mean() <= 0.6


def _projected(camera: Camera, pose: Pose, surface: np.ndarray) -> np.ndarray:
    x, y, z = ((surface - np.array(pose.position_m)) @ world_from_camera(pose)).T
    return np.stack([camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy], axis=1)


def _matched(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b = extract(first), extract(second)
    near = cv2.BFMatcher(cv2.NORM_L2).knnMatch(a.descriptors, b.descriptors, 2)
    good = [best for best, rival in near if best.distance < 0.75 * rival.distance]
    here = np.array([a.keypoints_px[match.queryIdx] for match in good], float)
    return here, np.array([b.keypoints_px[match.trainIdx] for match in good], float)
