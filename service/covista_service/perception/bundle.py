"""Bundle adjustment with pose priors: keyframes and points that agree with the images and stay near what was reported.

Levenberg-Marquardt on reprojection errors under Cauchy's loss; points are eliminated (Schur complement), so the system
to solve has six rows per keyframe (Triggs et al., "Bundle Adjustment - A Modern Synthesis", 1999).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats

_AHEAD = 1e-9
# A point behind a camera costs as much as one that is this far off, in px squared.
_BEHIND = 1e6
_HELD = 1e12
_TRIES = 8


@dataclass(frozen=True, slots=True)
class BundleOptions:
    """`loss_px` is the scale of Cauchy's loss; a step that gains less than `least_gain` of the cost is the last."""

    loss_px: float = 2.0
    iterations: int = 60
    least_gain: float = 1e-5


class Tracks(NamedTuple):
    """Points and who sees them: the sightings of point p are `starts`[p] to `starts`[p + 1].

    `keyframes` (n,) index, `rays` (n, 2) = (X/Z, Y/Z), `focal_px` (n,) pixels per unit of them.
    """

    starts: NDArray[np.int64]
    keyframes: NDArray[np.int64]
    rays: Floats
    focal_px: Floats


class Poses(NamedTuple):
    """`rotations` (K, 3, 3) world_from_camera and `centres` (K, 3)."""

    rotations: Floats
    centres: Floats


class Prior(NamedTuple):
    """Reported poses and what they are worth: `information` (K, 2) is 1/variance of rotation (rad) and position.

    Keyframes that are not `free` (K,) stay.
    """

    poses: Poses
    information: Floats
    free: NDArray[np.bool_]


class _Scene(NamedTuple):
    poses: Poses
    points: Floats


class _Point(NamedTuple):
    """Normal equations of one point: inverse of its own block, gradient, and its blocks with each sighting's camera."""

    inverse: Floats
    gradient: Floats
    coupling: Floats


def bundle(start: Poses, prior: Prior, tracks: Tracks, options: BundleOptions) -> Poses:
    """The poses, from `start`, that tell best what was sighted; points behind a camera there take no part."""
    points, used = _triangulated(start, tracks)
    scene = _Scene(start, points)
    cost = _cost(scene, used, prior, tracks, options.loss_px)
    damping = 1e-3
    for _ in range(options.iterations):
        for _ in range(_TRIES):
            tried = _stepped(scene, used, prior, tracks, options.loss_px, damping)
            tried_cost = _cost(tried, used, prior, tracks, options.loss_px)
            if tried_cost < cost:
                break
            damping *= 4
        else:
            break
        gain = (cost - tried_cost) / cost
        scene, cost, damping = tried, tried_cost, max(damping / 5, 1e-9)
        if gain < options.least_gain:
            break
    return scene.poses


@compiled
def _turned(turn: NDArray[np.floating]) -> Floats:
    """Rotation matrix of a rotation vector (Rodrigues)."""
    angle = np.sqrt((turn * turn).sum())
    x, y, z = turn
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Floats = np.eye(3) + cross
    if angle > 1e-9:
        rotation += (np.sin(angle) / angle - 1) * cross + (1 - np.cos(angle)) / angle**2 * (cross @ cross)
    return rotation


@compiled
def _turn_of(rotation: Floats) -> Floats:
    """Rotation vector of a rotation matrix, for turns well below half a circle."""
    across = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = 0.5 * np.sqrt((across * across).sum())
    angle = np.arctan2(sine, 0.5 * (rotation[0, 0] + rotation[1, 1] + rotation[2, 2] - 1))
    return across * 0.5 if sine < 1e-9 else across * (0.5 * angle / sine)


@compiled
def _triangulated(poses: Poses, tracks: Tracks) -> tuple[Floats, NDArray[np.bool_]]:
    """The point nearest to all rays of each track, and whether it lies ahead of all its cameras."""
    count = len(tracks.starts) - 1
    points, used = np.zeros((count, 3)), np.ones(count, np.bool_)
    for p in range(count):
        normal, right = np.zeros((3, 3)), np.zeros(3)
        for o in range(tracks.starts[p], tracks.starts[p + 1]):
            k = tracks.keyframes[o]
            ray = poses.rotations[k] @ np.array([tracks.rays[o, 0], tracks.rays[o, 1], 1.0])
            across = np.eye(3) - np.outer(ray, ray) / (ray * ray).sum()
            normal += across
            right += across @ poses.centres[k]
        normal += np.eye(3) * (1e-9 * np.trace(normal))
        points[p] = np.linalg.solve(normal, right)
        for o in range(tracks.starts[p], tracks.starts[p + 1]):
            k = tracks.keyframes[o]
            used[p] &= (poses.rotations[k][:, 2] * (points[p] - poses.centres[k])).sum() > _AHEAD
    return points, used


@compiled
def _cost(scene: _Scene, used: NDArray[np.bool_], prior: Prior, tracks: Tracks, loss_px: float) -> float:
    total = 0.0
    rotations, centres = scene.poses.rotations, scene.poses.centres
    for p in range(len(scene.points)):
        if not used[p]:
            continue
        for o in range(tracks.starts[p], tracks.starts[p + 1]):
            k = tracks.keyframes[o]
            x, y, z = rotations[k].T @ (scene.points[p] - centres[k])
            squared = _BEHIND
            if z > _AHEAD:
                squared = tracks.focal_px[o] ** 2 * (
                    (x / z - tracks.rays[o, 0]) ** 2 + (y / z - tracks.rays[o, 1]) ** 2
                )
            total += loss_px**2 * np.log1p(squared / loss_px**2)
    for k in range(len(rotations)):
        turn = _turn_of(prior.poses.rotations[k].T @ rotations[k])
        shift = centres[k] - prior.poses.centres[k]
        total += prior.information[k, 0] * (turn * turn).sum() + prior.information[k, 1] * (shift * shift).sum()
    return float(total)


@compiled
def _sighting(
    rotation: Floats, centre: Floats, point: Floats, ray: Floats, focal_px: float, loss_px: float
) -> tuple[float, Floats, Floats, Floats]:
    """Weight, residual (2,) px, and its derivatives by the camera (2, 6: turn on the right, shift) and point (2, 3)."""
    by_camera, by_point, residual = np.zeros((2, 6)), np.zeros((2, 3)), np.zeros(2)
    x, y, z = rotation.T @ (point - centre)
    if z <= _AHEAD:
        return 0.0, residual, by_camera, by_point
    u, v, scale = x / z, y / z, focal_px / z
    residual[0], residual[1] = focal_px * (u - ray[0]), focal_px * (v - ray[1])
    for c in range(3):
        by_point[0, c] = scale * (rotation[c, 0] - u * rotation[c, 2])
        by_point[1, c] = scale * (rotation[c, 1] - v * rotation[c, 2])
    by_camera[:, 3:] = -by_point
    # R <- R exp(w) moves X_camera by X_camera x w.
    by_camera[0, 0], by_camera[1, 0] = scale * u * y, scale * (z + v * y)
    by_camera[0, 1], by_camera[1, 1] = -scale * (z + u * x), -scale * v * x
    by_camera[0, 2], by_camera[1, 2] = scale * y, -scale * x
    weight = 1 / (1 + (residual * residual).sum() / loss_px**2)
    return weight, residual, by_camera, by_point


@compiled
def _eliminated(
    scene: _Scene,
    p: np.signedinteger,
    prior: Prior,
    tracks: Tracks,
    loss_px: float,
    damping: float,
    matrix: Floats,
    right: Floats,
) -> _Point:
    """One point's part of the normal equations; `matrix` and `right` of the cameras take theirs."""
    start, end = tracks.starts[p], tracks.starts[p + 1]
    own, gradient, coupling = np.zeros((3, 3)), np.zeros(3), np.zeros((end - start, 6, 3))
    for o in range(start, end):
        k = tracks.keyframes[o]
        weight, residual, by_camera, by_point = _sighting(
            scene.poses.rotations[k],
            scene.poses.centres[k],
            scene.points[p],
            tracks.rays[o],
            tracks.focal_px[o],
            loss_px,
        )
        own += weight * (by_point.T @ by_point)
        gradient += weight * (by_point.T @ residual)
        if prior.free[k]:
            coupling[o - start] = weight * (by_camera.T @ by_point)
            at = slice(6 * k, 6 * k + 6)
            block = weight * (by_camera.T @ by_camera)
            matrix[at, at] += block + damping * np.diag(np.diag(block))
            right[at] -= weight * (by_camera.T @ residual)
    inverse = np.linalg.inv(own + damping * np.diag(np.diag(own)) + np.eye(3) * (1e-12 * np.trace(own) + 1e-30))
    for o in range(start, end):
        solved = coupling[o - start] @ inverse
        i = 6 * tracks.keyframes[o]
        right[i : i + 6] += solved @ gradient
        for other in range(start, end):
            j = 6 * tracks.keyframes[other]
            matrix[i : i + 6, j : j + 6] -= solved @ coupling[other - start].T
    return _Point(inverse, gradient, coupling)


@compiled
def _stepped(
    scene: _Scene, used: NDArray[np.bool_], prior: Prior, tracks: Tracks, loss_px: float, damping: float
) -> _Scene:
    """The scene after one damped Gauss-Newton step."""
    rotations, centres = scene.poses.rotations.copy(), scene.poses.centres.copy()
    points = scene.points.copy()
    matrix, right = np.zeros((6 * len(centres), 6 * len(centres))), np.zeros(6 * len(centres))
    eliminated = [_eliminated(scene, p, prior, tracks, loss_px, damping, matrix, right) for p in np.flatnonzero(used)]
    for k in range(len(centres)):
        i = 6 * k
        turn = _turn_of(prior.poses.rotations[k].T @ rotations[k])
        right[i : i + 3] -= prior.information[k, 0] * turn
        right[i + 3 : i + 6] -= prior.information[k, 1] * (centres[k] - prior.poses.centres[k])
        for r in range(6):
            matrix[i + r, i + r] += prior.information[k, r // 3] * (1 + damping) + (0.0 if prior.free[k] else _HELD)
        if not prior.free[k]:
            right[i : i + 6] = 0.0
    step = np.linalg.solve(matrix, right)
    for k in range(len(centres)):
        if prior.free[k]:
            rotations[k] = rotations[k] @ _turned(step[6 * k : 6 * k + 3])
            centres[k] += step[6 * k + 3 : 6 * k + 6]
    for n, p in enumerate(np.flatnonzero(used)):
        gradient = -eliminated[n].gradient
        for o in range(tracks.starts[p], tracks.starts[p + 1]):
            i = 6 * tracks.keyframes[o]
            gradient -= eliminated[n].coupling[o - tracks.starts[p]].T @ step[i : i + 6]
        points[p] += eliminated[n].inverse @ gradient
    return _Scene(Poses(rotations, centres), points)
