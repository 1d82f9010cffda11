"""The survey of a pair of keyframes: what do both cameras see?"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats, View, relative, undistort
from covista_service.perception.fuzzy import Points
from covista_service.perception.matching import MatchingOptions, match
from covista_service.perception.overlap import common_field, inverse_depths_second
from covista_service.perception.planes import FoundPlanes, PlaneOptions, find_planes
from covista_service.perception.polygon import corners
from covista_service.perception.relative_pose import PoseSource, RelativePoseOptions, Sightings, relative_pose
from covista_service.perception.territories import TerritoryOptions, territories
from covista_service.perception.triangulation import TriangulationOptions, triangulate


class Outcome(StrEnum):
    """What a survey came to. Only `measured` carries an overlap."""

    MEASURED = "measured"
    FEW_MATCHES = "few_matches"
    UNVERIFIED = "unverified"
    NO_PARALLAX = "no_parallax"
    NO_PLANE = "no_plane"
    KINDS_DIFFER = "kinds_differ"


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """u . X + 1 = 0 in the first camera's frame: `normal` u (3,), 1/m; region polygons (k, 2) px in both images."""

    normal: Floats
    support: int
    region_first: Floats
    region_second: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What a survey found; overlaps are q_1 and q_2 of Eq. 16, None unless measured.

    `rotation`, `translation`: X_2 = R X_1 + t as used. Points: inlier keypoints of both images (k, 2) in ideal px,
    with their depths Z (k,) in each camera, and the plane index (k,) of each, -1 for none.
    """

    outcome: Outcome
    overlap_first: float | None = None
    overlap_second: float | None = None
    matches: int = 0
    inliers: int = 0
    pose_source: PoseSource | None = None
    rotation: Floats = field(default_factory=lambda: np.eye(3))
    translation: Floats = field(default_factory=lambda: np.zeros(3))
    planes: tuple[Plane, ...] = ()
    points_first_px: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    points_second_px: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    depths_first: Floats = field(default_factory=lambda: np.zeros(0))
    depths_second: Floats = field(default_factory=lambda: np.zeros(0))
    plane_of_point: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))


@dataclass(frozen=True, slots=True)
class SurveyOptions:
    """Options of all stages. `min_matches`: with fewer, nothing can be verified."""

    seed: int = 0
    min_matches: int = 8
    matching: MatchingOptions = field(default_factory=MatchingOptions)
    pose: RelativePoseOptions = field(default_factory=RelativePoseOptions)
    triangulation: TriangulationOptions = field(default_factory=TriangulationOptions)
    planes: PlaneOptions = field(default_factory=PlaneOptions)
    territories: TerritoryOptions = field(default_factory=TerritoryOptions)


def seen_orders(
    first: Camera, second: Camera, found: Survey, planes: FoundPlanes, options: TerritoryOptions
) -> tuple[Floats, Floats]:
    """Which plane a pixel of either image shows."""
    nearest_first = -planes.normals @ np.linalg.inv(first.matrix)
    nearest_second, _ = inverse_depths_second(second, found.rotation, found.translation, planes.normals)
    return (
        territories(found.points_first_px, planes.labels, nearest_first, options),
        territories(found.points_second_px, planes.labels, nearest_second, options),
    )


def survey(first: View, second: View, options: SurveyOptions, prior: Survey | None = None) -> Survey:
    """Survey a pair of views; `prior` is the pair's last survey, to start from."""
    if first.features.kind != second.features.kind:
        return Survey(Outcome.KINDS_DIFFER)

    # Matched feature points ...
    matches = match(first.features, second.features, options.matching)
    if len(matches) < options.min_matches:
        return Survey(Outcome.FEW_MATCHES, matches=len(matches))
    first_px = undistort(first.camera, first.features.keypoints_px[matches[:, 0]])
    second_px = undistort(second.camera, second.features.keypoints_px[matches[:, 1]])

    # ... that agree with the relative pose, which is as reported unless the images know better ...
    sightings = Sightings(first.camera, second.camera, first_px, second_px)
    pose = relative_pose(sightings, *relative(first.pose, second.pose), options.pose, options.seed)
    found = Survey(
        Outcome.UNVERIFIED,
        matches=len(matches),
        inliers=int(pose.inliers.sum()),
        pose_source=pose.source,
        rotation=pose.rotation,
        translation=pose.translation,
    )
    if not pose.verified:
        return found

    # ... are triangulated ...
    seen = pose.inliers
    points = triangulate(
        first.camera,
        second.camera,
        pose.rotation,
        pose.translation,
        first_px[seen],
        second_px[seen],
        options.triangulation,
    )
    kept = points.kept
    points = points.only(kept)
    if len(points.rays) < options.planes.min_support:
        return replace(found, outcome=Outcome.NO_PARALLAX)
    found = replace(
        found,
        points_first_px=first_px[seen][kept],
        points_second_px=second_px[seen][kept],
        depths_first=points.depths_first,
        depths_second=points.depths_second,
        plane_of_point=np.full(len(points.rays), -1),
    )

    # ... and grouped into planes by adaptive fuzzy clustering;
    known = None if prior is None else np.array([-plane.normal for plane in prior.planes]).reshape(-1, 3)
    cloud = Points(points.rays, points.inverse_depths, points.shifts_px)
    planes = find_planes(cloud, options.planes, options.seed, known)
    if not len(planes.normals):
        return replace(found, outcome=Outcome.NO_PLANE)

    # the common field of view is what both cameras see of those planes.
    orders = seen_orders(first.camera, second.camera, found, planes, options.territories)
    field_of_view = common_field(first.camera, second.camera, pose.rotation, pose.translation, planes.normals, orders)
    return replace(
        found,
        outcome=Outcome.MEASURED,
        overlap_first=field_of_view.overlap_first,
        overlap_second=field_of_view.overlap_second,
        planes=tuple(
            Plane(normal, int((planes.labels == k).sum()), corners(region_first), corners(region_second))
            for k, (normal, region_first, region_second) in enumerate(
                zip(planes.normals, field_of_view.regions_first, field_of_view.regions_second, strict=True)
            )
        ),
        plane_of_point=planes.labels,
    )
