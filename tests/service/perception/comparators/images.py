"""Images of features for the measures that need no camera."""

from __future__ import annotations

import numpy as np
from covista_service.perception.camera import Features
from covista_service.perception.comparators.image import Image, image_of

from tests.service.perception.scenes import beside, corner, scene

LENGTH = {"rootsift": 128, "orb": 32}
HOPELESS = [(0, 0), (0, 9), (9, 0), (1, 1), (1, 9), (7, 7), (9, 9)]


def unrelated(seed: int, count: int = 400, kind: str = "rootsift") -> Image:
    """Features of their own all over a picture of 640 x 480."""
    random = np.random.default_rng(seed)
    points = random.uniform(-0.5, (639.5, 479.5), (count, 2)).astype(np.float32)
    if kind == "orb":
        return Image(Features(kind, points, random.integers(0, 256, (count, 32), np.uint8)), 640, 480)
    raw = np.abs(random.normal(size=(count, 128)))
    descriptors = np.rint(512 * raw / np.linalg.norm(raw, axis=1, keepdims=True)).astype(np.uint8)
    return Image(Features(kind, points, descriptors), 640, 480)


def alike(count: int, kind: str = "rootsift") -> tuple[Image, Image]:
    """Two images of one place and one descriptor, over and over."""
    points = np.full((count, 2), 7.0, np.float32)
    image = Image(Features(kind, points, np.full((count, LENGTH[kind]), 3, np.uint8)), 640, 480)
    return image, image


def pair(count: int = 200, noise_px: float = 0.0, seed: int = 0) -> tuple[Image, Image]:
    """Two images of a corner that match each other."""
    seen = scene(corner(), beside(seed), count, noise_px, seed=seed)
    return image_of(seen.first), image_of(seen.second)


def mixed(shared: int, own: int, seed: int = 0) -> tuple[Image, Image]:
    """Two images of which `shared` features or so match, and `own` do not."""
    return _with(pair(shared, seed=seed)[0], unrelated(100 + seed, own)), _with(
        pair(shared, seed=seed)[1], unrelated(200 + seed, own)
    )


def _with(image: Image, more: Image) -> Image:
    one, other = image.features, more.features
    points = np.concatenate((one.keypoints_px, other.keypoints_px))
    return Image(Features(one.kind, points, np.concatenate((one.descriptors, other.descriptors))), 640, 480)
