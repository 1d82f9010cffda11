"""The survey of a pair of keyframes: what do both cameras see?"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats, View
from covista_service.perception.comparison import Comparison, ComparisonOptions, compare
from covista_service.perception.comparison import Outcome as Outcome
from covista_service.perception.epipolar import homogeneous, transfer_errors
from covista_service.perception.fuzzy import Points
from covista_service.perception.matching import MatchingOptions
from covista_service.perception.overlap import CommonField, common_field, inverse_depths_second
from covista_service.perception.planes import FoundPlanes, PlaneOptions, find_planes
from covista_service.perception.polygon import corners
from covista_service.perception.relative_pose import PoseSource, RelativePose
from covista_service.perception.sightings import Sightings
from covista_service.perception.territories import Marks, TerritoryOptions, territories
from covista_service.perception.triangulation import Triangulation, TriangulationOptions, triangulate

# Of the points that agree with a pose without parallax, as many must be where far points would be.
_FAR_SHARE = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """u . X + 1 = 0 in the first camera's frame: `normal` u (3,), 1/m; region polygons (k, 2) px in both images."""

    normal: Floats
    support: int
    region_first: Floats
    region_second: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What a survey found; overlaps are q_1 and q_2 of Eq. 16, None unless measured or without any parallax.

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
    """Options of all stages; `seed` of the clustering."""

    seed: int = 0
    comparison: ComparisonOptions = field(default_factory=lambda: ComparisonOptions(matching=MatchingOptions()))
    triangulation: TriangulationOptions = field(default_factory=TriangulationOptions)
    planes: PlaneOptions = field(default_factory=PlaneOptions)
    territories: TerritoryOptions = field(default_factory=TerritoryOptions)


def survey(first: View, second: View, options: SurveyOptions, prior: Survey | None = None) -> Survey:
    """What do two keyframes see in common? `prior` is the pair's last survey, to start from.

    A hopeless pair comes to an outcome with a name.
    """
    compared = compare(first, second, options.comparison)
    return explain(first.camera, second.camera, compared, options, prior)


def explain(
    first: Camera, second: Camera, compared: Comparison, options: SurveyOptions, prior: Survey | None = None
) -> Survey:
    """The same for a pair whose images have been compared."""
    if not compared.comparable:
        return Survey(Outcome.KINDS_DIFFER)

    # "n matched feature points ..."
    sightings = compared.sightings
    matches = len(sightings.first_px)
    if not compared.enough:
        return Survey(Outcome.FEW_MATCHES, matches=matches)

    # "... the orientation of both cameras is known, similarly the baseline": as reported, or better from the images.
    pose = compared.pose
    found = _with_pose(pose, matches)
    if not pose.verified:
        return found

    # "... with triangulated 3D coordinates": Eq. 8.
    sightings = sightings.only(pose.inliers)
    triangulated = triangulate(sightings, pose.rotation, pose.translation, options.triangulation)
    if triangulated.kept.sum() < options.planes.min_support:
        return _without_parallax(sightings, found, options.comparison.pose.inlier_px)
    found = _with_points(found, sightings, triangulated)

    # "Adaptive fuzzy plane clustering": Eqs. 1 to 6.
    points = triangulated.only(triangulated.kept)
    cloud = Points(points.rays, points.inverse_depths, points.shifts_px)
    planes = find_planes(cloud, options.planes, options.seed, _known_planes(prior))
    if not len(planes.normals):
        return replace(found, outcome=Outcome.NO_PLANE)
    found = replace(found, plane_of_point=planes.labels)

    # "Projecting the visible region of one camera on the planes and then on the image plane of another camera."
    orders = shown(first, second, found, planes, options.territories)
    common = common_field(first, second, pose.rotation, pose.translation, planes.normals, orders)
    return _measured(found, planes, common)


def _with_pose(pose: RelativePose, matches: int) -> Survey:
    return Survey(
        Outcome.UNVERIFIED,
        matches=matches,
        inliers=int(pose.inliers.sum()),
        pose_source=pose.source,
        rotation=pose.rotation,
        translation=pose.translation,
    )


def _without_parallax(sightings: Sightings, found: Survey, inlier_px: float) -> Survey:
    """All is seen as though endlessly far away, on the plane 0 . X + 1 = 0, whose homography is K_2 R K_1^-1.

    There is an overlap if that is where most points of the second image are.
    """
    first, second = sightings.first, sightings.second
    found = replace(found, outcome=Outcome.NO_PARALLAX)
    ends = homogeneous(sightings.first_px), homogeneous(sightings.second_px)
    if (transfer_errors(first, second, found.rotation, *ends) < inlier_px).mean() < _FAR_SHARE:
        return found
    common = common_field(first, second, found.rotation, np.zeros(3), np.zeros((1, 3)))
    return replace(found, overlap_first=common.overlap_first, overlap_second=common.overlap_second)


def _with_points(found: Survey, sightings: Sightings, points: Triangulation) -> Survey:
    return replace(
        found,
        points_first_px=sightings.first_px[points.kept],
        points_second_px=sightings.second_px[points.kept],
        depths_first=points.depths_first[points.kept],
        depths_second=points.depths_second[points.kept],
        plane_of_point=np.full(int(points.kept.sum()), -1),
    )


def _known_planes(prior: Survey | None) -> Floats | None:
    if prior is None or not prior.planes:
        return None
    return np.array([-plane.normal for plane in prior.planes])


def shown(
    first: Camera, second: Camera, found: Survey, planes: FoundPlanes, options: TerritoryOptions
) -> tuple[Floats, Floats]:
    """Which plane a pixel of either image shows, as rows (K, 3)."""
    on_plane = found.plane_of_point >= 0
    owners = found.plane_of_point[on_plane]
    nearest_first = -planes.normals @ first.rays_from_pixels
    nearest_second, _ = inverse_depths_second(second, found.rotation, found.translation, planes.normals)
    return territories(
        Marks(found.points_first_px[on_plane], owners, nearest_first),
        Marks(found.points_second_px[on_plane], owners, nearest_second),
        options,
    )


def _measured(found: Survey, planes: FoundPlanes, common: CommonField) -> Survey:
    regions = zip(common.regions_first, common.regions_second, strict=True)
    support = np.bincount(planes.labels[planes.labels >= 0], minlength=len(planes.normals)).tolist()
    return replace(
        found,
        outcome=Outcome.MEASURED,
        overlap_first=common.overlap_first,
        overlap_second=common.overlap_second,
        planes=tuple(
            Plane(normal, count, corners(in_first), corners(in_second))
            for normal, count, (in_first, in_second) in zip(planes.normals, support, regions, strict=True)
        ),
    )
