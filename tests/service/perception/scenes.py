"""Scenes of planes, seen by two cameras, with exact matches, noise and outliers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from covista_service.perception.camera import Camera, Features, Floats, Pose, View
from covista_service.perception.sightings import Sightings

CAMERA = Camera(np.array([[500.0, 0, 319.5], [0, 500.0, 239.5], [0, 0, 1]]), 640, 480)
ORIGIN = Pose(np.eye(3), np.zeros(3))


def turn(x_rad: float, y_rad: float, z_rad: float) -> Floats:
    return np.asarray(cv2.Rodrigues(np.array([x_rad, y_rad, z_rad], np.float64))[0], np.float64)


def plane(normal: tuple[float, float, float], distance_m: float) -> Floats:
    """The plane n . X = distance as u of u . X + 1 = 0."""
    return -np.array(normal) / np.linalg.norm(normal) / distance_m


def wall(distance_m: float = 6.0) -> Floats:
    return np.array([plane((0.1, 0, 1), distance_m)])


def corner() -> Floats:
    """A floor and two walls."""
    return np.array([plane((0, 1, 0), 1.5), plane((0.6, 0, 0.8), 4), plane((-0.8, 0, 0.6), 4)])


@dataclass(frozen=True)
class Scene:
    """Planes (K, 3) in the frame of the first camera, which is the world's; views of both; the plane of each point."""

    planes: Floats
    first: View
    second: View
    owners: np.ndarray

    def sightings(self) -> Sightings:
        """Its matches, in the order of `owners`."""
        first, second = self.first.features, self.second.features
        order = [int((second.descriptors == one).all(axis=1).argmax()) for one in first.descriptors]
        first_px, second_px = first.keypoints_px.astype(np.float64), second.keypoints_px.astype(np.float64)
        return Sightings(self.first.camera, self.second.camera, first_px, second_px[np.array(order, np.intp)])

    def with_poses(self, first: Pose, second: Pose) -> Scene:
        return replace(self, first=replace(self.first, pose=first), second=replace(self.second, pose=second))


def project(camera: Camera, pose: Pose, points: Floats) -> Floats:
    seen = (points - pose.centre_m) @ pose.world_from_camera @ camera.matrix.T
    return seen[:, :2] / seen[:, 2:]


def scene(
    planes: Floats,
    second: Pose,
    count: int = 200,
    noise_px: float = 0.0,
    outliers: float = 0.0,
    seed: int = 0,
    camera: Camera = CAMERA,
) -> Scene:
    """Points on the nearest planes; both cameras see each of them, outliers somewhere wrong along the epipolar line."""
    random = np.random.default_rng(seed)
    pixels = np.column_stack((random.uniform(0, camera.width - 1, count), random.uniform(0, camera.height - 1, count)))
    rays = np.column_stack((pixels, np.ones(count))) @ np.linalg.inv(camera.matrix).T
    inverse_depths = (-rays @ planes.T).max(axis=1)
    owners = (-rays @ planes.T).argmax(axis=1)
    wrong = random.random(count) < outliers
    inverse_depths[wrong] = random.uniform(1 / 12, 1 / 2, wrong.sum())
    owners[wrong] = -1
    points = rays / inverse_depths[:, None]
    ahead = (points - second.centre_m) @ second.world_from_camera[:, 2] > 0.1
    points, owners = points[ahead], owners[ahead]
    first_px = project(camera, ORIGIN, points) + random.normal(0, noise_px, (len(points), 2))
    second_px = project(camera, second, points) + random.normal(0, noise_px, (len(points), 2))
    inside = ((second_px >= -0.5) & (second_px < np.array([camera.width, camera.height]) - 0.5)).all(axis=1)
    first_px, second_px, owners = first_px[inside], second_px[inside], owners[inside]
    descriptors = random.integers(0, 90, (len(first_px), 128), dtype=np.uint8)
    shuffled = random.permutation(len(first_px))
    one = View(camera, ORIGIN, Features("rootsift", first_px.astype(np.float32), descriptors))
    other = Features("rootsift", second_px[shuffled].astype(np.float32), descriptors[shuffled])
    return Scene(planes, one, View(camera, second, other), owners)


def beside(seed: int = 0) -> Pose:
    """A second camera half a metre or so beside the first, turned a little."""
    random = np.random.default_rng(seed)
    side = random.choice([-1.0, 1.0])
    centre = np.array([side * random.uniform(0.4, 0.8), random.uniform(-0.1, 0.1), random.uniform(-0.3, 0.3)])
    return Pose(turn(*random.uniform(-0.1, 0.1, 3)), centre)
