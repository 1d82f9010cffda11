"""Scenes of known planes, seen by two cameras: matches with noise, and outliers along the epipolar lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats
from covista_service.perception.fuzzy import Points
from covista_service.perception.sightings import Sightings
from covista_service.perception.triangulation import TriangulationOptions, triangulate

CAMERA = Camera(np.array([[500.0, 0, 319.5], [0, 500.0, 239.5], [0, 0, 1]]), 640, 480)
Owners = NDArray[np.int64]
_POINTS = 240
# Of a plane that counts as seen.
_LEAST_POINTS = 15
_TRIES = 100
_OUTLIER_DEPTHS_M = 2.0, 12.0
_BOX_M = 2.0
_LEAST_DEPTH_M = 0.1
_LEAST_INVERSE_DEPTH = 1 / 40


@dataclass(frozen=True, slots=True, eq=False)
class PlaneScene:
    """Triangulated `points` and the true planes u (K, 3), u . X + 1 = 0 in the first camera's frame."""

    points: Points
    planes: Floats


# Planes u (K, 3) and points on them (n, 3) in the first camera's frame, with the plane (n,) of each.
_Surfaces = tuple[Floats, Floats, Owners]


def draw(name: str, outliers: float, noise_px: float, random: np.random.Generator) -> PlaneScene:
    """A scene of that kind, of which both cameras see enough of every plane; noise is in each coordinate."""
    for _ in range(_TRIES):
        planes, points, owners = SCENES[name](random)
        wrong = random.random(len(points)) < outliers
        nearness = random.uniform(1 / _OUTLIER_DEPTHS_M[1], 1 / _OUTLIER_DEPTHS_M[0], len(points))
        points = np.where(wrong[:, None], points / points[:, 2:] / nearness[:, None], points)
        rotation, translation = moved(random)
        first_px, second_px = _projected(points), _projected(points @ rotation.T + translation)
        seen = _inside(first_px) & _inside(second_px)
        noise = random.normal(0, noise_px, (2, len(points), 2))
        sightings = Sightings(CAMERA, CAMERA, (first_px + noise[0])[seen], (second_px + noise[1])[seen])
        found = triangulate(sightings, rotation, translation, TriangulationOptions())
        kept = found.only(found.kept)
        support = np.bincount(owners[seen & ~wrong][found.kept[~wrong[seen]]], minlength=len(planes))
        if support.min() >= _LEAST_POINTS:
            return PlaneScene(Points(kept.rays, kept.inverse_depths, kept.shifts_px), planes)
    raise ValueError(f"no scene {name!r} shows enough of all its planes")


def _wall(random: np.random.Generator) -> _Surfaces:
    return _nearest(np.array([_plane(_turn(random, 0.5) @ (0, 0, 1), random.uniform(4, 7))]), random)


def _floor_and_wall(random: np.random.Generator) -> _Surfaces:
    turn = _turn(random, 0.2)
    walls = [_plane(turn @ (0, 1, 0), random.uniform(1, 1.6)), _plane(turn @ (0, 0, 1), random.uniform(4, 7))]
    return _nearest(np.array(walls), random)


def _corner(random: np.random.Generator) -> _Surfaces:
    turn = _turn(random, 0.15)
    walls = [
        _plane(turn @ (0, 1, 0), random.uniform(1, 1.6)),
        _plane(turn @ (0.6, 0, 0.8), random.uniform(3.5, 4.5)),
        _plane(turn @ (-0.8, 0, 0.6), random.uniform(3.5, 4.5)),
    ]
    return _nearest(np.array(walls), random)


def _box(random: np.random.Generator) -> _Surfaces:
    """The top and two upright sides of a box, which end where they meet: in front of nothing."""
    axes = (_rotation((0.45, 0, 0)) @ _rotation((0, random.uniform(0.5, 1.0), 0))).T
    towards = np.array([0, 0.2, random.uniform(4, 5)])
    outwards = axes * -np.sign(axes @ towards)[:, None]
    planes = np.array([_plane(out, out @ (towards + out * _BOX_M / 2)) for out in outwards])
    owners = np.arange(_POINTS) % 3
    place = random.uniform(-_BOX_M / 2, _BOX_M / 2, (_POINTS, 3))
    place[np.arange(_POINTS), owners] = _BOX_M / 2
    return planes, towards + place @ outwards, owners


def _nearest(planes: Floats, random: np.random.Generator) -> _Surfaces:
    """Points on the first of endless planes that pixels anywhere in the first image meet."""
    pixels = np.column_stack((random.uniform(0, 639, _POINTS), random.uniform(0, 479, _POINTS), np.ones(_POINTS)))
    rays = pixels @ CAMERA.rays_from_pixels.T
    inverse_depths = -rays @ planes.T
    met = inverse_depths.max(axis=1) > _LEAST_INVERSE_DEPTH
    points = rays[met] / inverse_depths[met].max(axis=1)[:, None]
    return planes, points, inverse_depths[met].argmax(axis=1)


def _plane(normal: Floats, distance_m: float) -> Floats:
    """The plane n . X = distance as u of u . X + 1 = 0."""
    return np.asarray(-normal / distance_m, np.float64)


def _rotation(vector_rad: Sequence[float] | Floats) -> Floats:
    return np.asarray(cv2.Rodrigues(np.array(vector_rad, np.float64))[0], np.float64)


def _turn(random: np.random.Generator, most_rad: float) -> Floats:
    return _rotation(random.uniform(-most_rad, most_rad, 3))


def moved(random: np.random.Generator) -> tuple[Floats, Floats]:
    """R and t of a second camera half a metre or so beside the first, turned a little."""
    side = random.choice([-1.0, 1.0]) * random.uniform(0.4, 0.8)
    centre = np.array([side, random.uniform(-0.1, 0.1), random.uniform(-0.3, 0.3)])
    rotation = _turn(random, 0.1)
    return rotation, -rotation @ centre


def _projected(points: Floats) -> Floats:
    """Pixels (n, 2) of points (n, 3); far outside of the image where a point is not ahead."""
    ahead = points[:, 2] > _LEAST_DEPTH_M
    seen = points @ CAMERA.matrix.T / np.where(ahead, points[:, 2], 1.0)[:, None]
    return np.where(ahead[:, None], seen[:, :2], -np.inf)


def _inside(points_px: Floats) -> NDArray[np.bool_]:
    within = (points_px >= 0) & (points_px <= (CAMERA.width - 1, CAMERA.height - 1))
    return np.asarray(within.all(axis=1), np.bool_)


SCENES: Mapping[str, Callable[[np.random.Generator], _Surfaces]] = {
    "wall": _wall,
    "floor_wall": _floor_and_wall,
    "corner": _corner,
    "box": _box,
}
