"""Epipolar geometry of matched points, as functions of arrays."""

from __future__ import annotations

import numpy as np

from covista_service.perception.camera import Camera, Floats

_TINY = 1e-300


def homogeneous(points_px: Floats) -> Floats:
    """Points (n, 2) -> (n, 3)."""
    return np.column_stack((points_px, np.ones(len(points_px))))


def cross_matrix(v: Floats) -> Floats:
    """[v]x (3, 3), so that [v]x w = v x w."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def fundamental(first: Camera, second: Camera, rotation: Floats, translation: Floats) -> Floats:
    """F (3, 3) with v_2 . F v_1 = 0 in pixels, for X_2 = R X_1 + t."""
    essential = cross_matrix(translation) @ rotation
    matrix: Floats = second.rays_from_pixels.T @ essential @ first.rays_from_pixels
    return matrix


def residuals(F: Floats, first_px: Floats, second_px: Floats) -> tuple[Floats, Floats]:
    """Signed Sampson errors (n,) in px of homogeneous matches (n, 3), and the algebraic error's gradient norm (n,)."""
    lines_second = first_px @ F.T
    lines_first = second_px @ F
    algebraic = np.einsum("ij,ij->i", second_px, lines_second)
    squared = (lines_second[:, :2] ** 2).sum(axis=1) + (lines_first[:, :2] ** 2).sum(axis=1)
    norm = np.sqrt(squared + _TINY)
    return algebraic / norm, norm


def transfer_errors(first: Camera, second: Camera, rotation: Floats, first_px: Floats, second_px: Floats) -> Floats:
    """Distances (n,) in px between homogeneous points (n, 3) of image 2 and where far points of image 1 would be."""
    mapped = first_px @ (second.matrix @ rotation @ first.rays_from_pixels).T
    ahead = mapped[:, 2] > _TINY
    depth = np.where(ahead, mapped[:, 2], 1.0)
    gap = np.hypot(mapped[:, 0] / depth - second_px[:, 0], mapped[:, 1] / depth - second_px[:, 1])
    return np.where(ahead, gap, np.inf)
