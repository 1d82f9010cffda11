"""Robust refinement of a relative pose on matches, held by what is known of it beforehand."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from covista_service.perception.camera import Camera, Floats
from covista_service.perception.epipolar import cross_matrix, residuals

_ITERATIONS = 12
_CONVERGED = 1e-6
_DAMPING = 1e-6

Inverses = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class PosePrior:
    """A pose known beforehand: rotation, unit direction of t (None where unknown), and how far off either may be."""

    rotation: Floats
    direction: Floats | None
    rotation_sigma_rad: float = 0.05
    direction_sigma: float = 0.15

    def weighted(self, rotation_sigma_rad: float, direction_sigma: float) -> PosePrior:
        """The same pose with other uncertainties."""
        return replace(self, rotation_sigma_rad=float(rotation_sigma_rad), direction_sigma=direction_sigma)


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """A pose (R, unit t) and its cost, the smaller the better."""

    rotation: Floats
    direction: Floats
    cost: float


def refine(
    first: Camera,
    second: Camera,
    first_px: Floats,
    second_px: Floats,
    rotation: Floats,
    direction: Floats,
    prior: PosePrior,
) -> Refined:
    """Minimise the Cauchy loss of Sampson errors of homogeneous matches (n, 3), plus the prior's, from a start (R, t).

    Levenberg's iteration over a rotation vector and two tangents of the direction.
    """
    inverses = second.rays_from_pixels.T, first.rays_from_pixels
    products = (second_px[:, :, None] * first_px[:, None, :]).reshape(-1, 9)  # v_2 . F v_1 is linear in F
    best = Refined(rotation, direction, np.inf)
    damping = _DAMPING
    step: Floats = np.zeros(5)
    for _ in range(_ITERATIONS):
        tried = _moved(best, step)
        errors, norm = residuals(_fundamental(tried, inverses), first_px, second_px)
        off = _deviation(tried, prior)
        cost = float(np.log1p(errors**2).sum() + off @ off)
        if cost < best.cost:
            converged = best.cost - cost < _CONVERGED * cost
            best, damping = replace(tried, cost=cost), damping / 10
            slopes = (products @ _derivatives(best, inverses)) / norm[:, None]
            weighted = slopes / (1 + errors[:, None] ** 2)  # Cauchy's weights
            prior_slopes = _deviation_slopes(best, prior)
            normal = weighted.T @ slopes + prior_slopes.T @ prior_slopes
            gradient = weighted.T @ errors + prior_slopes.T @ off
            if converged:
                break
        else:
            damping = max(damping, _DAMPING) * 100
        damped = normal + damping * np.diag(normal.diagonal() + 1e-12)
        step = np.asarray(-np.linalg.solve(damped, gradient), np.float64)
    return best


def _moved(pose: Refined, step: Floats) -> Refined:
    turn = np.asarray(cv2.Rodrigues(step[:3])[0], np.float64)
    direction = pose.direction + _tangents(pose.direction) @ step[3:]
    return Refined(turn @ pose.rotation, direction / np.linalg.norm(direction), np.inf)


def _fundamental(pose: Refined, inverses: Inverses) -> Floats:
    matrix: Floats = inverses[0] @ cross_matrix(pose.direction) @ pose.rotation @ inverses[1]
    return matrix


def _derivatives(pose: Refined, inverses: Inverses) -> Floats:
    """Derivatives (9, 5) of F by the rotation vector and by the direction's tangents."""
    across = cross_matrix(pose.direction)
    turned = [across @ cross_matrix(axis) @ pose.rotation for axis in np.eye(3)]
    moved = [cross_matrix(tangent) @ pose.rotation for tangent in _tangents(pose.direction).T]
    return np.column_stack([(inverses[0] @ change @ inverses[1]).ravel() for change in (*turned, *moved)])


def _deviation(pose: Refined, prior: PosePrior) -> Floats:
    """How far (6,) a pose is from the prior, in its sigmas."""
    turn = np.asarray(cv2.Rodrigues(pose.rotation @ prior.rotation.T)[0], np.float64)[:, 0]
    shift = np.zeros(3) if prior.direction is None else pose.direction - prior.direction
    return np.concatenate((turn / prior.rotation_sigma_rad, shift / prior.direction_sigma))


def _deviation_slopes(pose: Refined, prior: PosePrior) -> Floats:
    """Derivatives (6, 5) of the deviation, to first order."""
    slopes = np.zeros((6, 5))
    slopes[:3, :3] = np.eye(3) / prior.rotation_sigma_rad
    if prior.direction is not None:
        slopes[3:, 3:] = _tangents(pose.direction) / prior.direction_sigma
    return slopes


def _tangents(direction: Floats) -> Floats:
    """Two unit vectors (3, 2) across a unit vector and each other."""
    across = cross_matrix(direction)
    aside = across[:, np.abs(direction).argmin()]
    aside = aside / np.linalg.norm(aside)
    tangents: Floats = np.column_stack((aside, across @ aside))
    return tangents
