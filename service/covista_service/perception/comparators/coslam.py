"""Do two cameras see the same part of the map? When CoSLAM splits and merges groups of cameras.

Zou and Tan, "CoSLAM: Collaborative Visual SLAM in Dynamic Environments", PAMI 35 (2013). Preset `CODE` holds the
numbers of the authors' released program, `PAPER` those of the article, from memory. The test was made for a yes or no;
here its share serves as a measure of overlap. Unlike there, points behind a camera are not in its view, and all its
features count, whether they are in the map or not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from covista_service.perception.camera import Camera, Floats

# OpenCV's hull has its corners in single precision.
_ON_EDGE_PX = 1e-3


@dataclass(frozen=True, slots=True)
class CoslamOptions:
    """When one camera sees what another has mapped, and what joins two cameras.

    At least `least_points` of the points, and `least_share` of them, must be in view; their hull must hold `cover` of
    the features, or more than `many_features`, or cover that share of the area. Cameras further apart than `reach`
    mean initial distances are never joined; between two merges `rest_frames` must pass.
    """

    least_points: int = 10
    least_share: float = 0.0
    measure: Literal["features", "area"] = "features"
    cover: float = 0.5
    many_features: float = 50
    shared_points: int = 1
    reach: float = 6.0
    rest_frames: int = 130


CODE = CoslamOptions()
PAPER = CoslamOptions(least_points=3, least_share=0.3, measure="area", cover=0.7, many_features=np.inf)


@dataclass(frozen=True, slots=True)
class Look:
    """How many of another camera's `points` a camera has `in_view`, and what their convex hull covers there.

    Of the camera's own `features` those `inside`, and `area` as a share of its image.
    """

    points: int
    in_view: int
    features: int
    inside: int
    area: float


def look(points: Floats, camera: Camera, features_px: Floats) -> Look:
    """How a camera sees points (n, 3), in its own frame, that another has mapped; its features (m, 2) in ideal px."""
    ahead = points[points[:, 2] > 0]
    projected = ahead @ camera.matrix.T
    px = projected[:, :2] / projected[:, 2:]
    last = np.array([camera.width, camera.height]) - 0.5
    px = px[((px >= -0.5) & (px <= last)).all(axis=1)].astype(np.float32)
    if len(px) < 3:
        return Look(len(points), len(px), len(features_px), 0, 0.0)
    hull = np.asarray(cv2.convexHull(px))[:, 0]
    inside = int(_inside(hull.astype(np.float64), features_px).sum())
    return Look(len(points), len(px), len(features_px), inside, min(1.0, cv2.contourArea(hull) / camera.pixels))


def share(seen: Look, options: CoslamOptions = CODE) -> float:
    """The share of the camera's features, or of its area, inside the hull; 0 where too few points are in view."""
    if seen.in_view < max(options.least_points, options.least_share * seen.points):
        return 0.0
    if options.measure == "area":
        return seen.area
    return seen.inside / seen.features if seen.features else 0.0


def overlaps(seen: Look, options: CoslamOptions = CODE) -> bool:
    """Does a camera see enough of what the other has mapped?"""
    covered = share(seen, options)
    return covered > 0 and (covered >= options.cover or seen.inside > options.many_features)


def may_merge(
    forth: Look,
    back: Look,
    distance_m: float,
    initial_distance_m: float,
    frames_since_merge: int,
    options: CoslamOptions = CODE,
) -> bool:
    """May the groups of two cameras become one? `initial_distance_m`: mean distance of all cameras at the start."""
    rested = frames_since_merge >= options.rest_frames
    near = distance_m <= options.reach * initial_distance_m
    return rested and near and overlaps(forth, options) and overlaps(back, options)


def groups(
    shared_points: NDArray[np.integer], distance_m: Floats, initial_distance_m: float, options: CoslamOptions = CODE
) -> NDArray[np.int64]:
    """Labels (N,) of groups that remain when cameras without a common map point, or too far apart, part.

    `shared_points`, `distance_m` (N, N): groups are the connected components.
    """
    joined = (shared_points >= options.shared_points) & (distance_m <= options.reach * initial_distance_m)
    _, labels = connected_components(coo_array(joined), directed=False)
    return np.asarray(labels, np.int64)


def _inside(hull: Floats, points_px: Floats) -> NDArray[np.bool_]:
    """Which points (m, 2) a convex polygon (k, 2) holds, whichever way round it runs: on one side of all edges."""
    edges = np.roll(hull, -1, axis=0) - hull
    edges /= np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), _ON_EDGE_PX)
    apart = points_px[:, None] - hull
    side_px = edges[:, 0] * apart[:, :, 1] - edges[:, 1] * apart[:, :, 0]
    return np.asarray((side_px >= -_ON_EDGE_PX).all(axis=1) | (side_px <= _ON_EDGE_PX).all(axis=1), np.bool_)
