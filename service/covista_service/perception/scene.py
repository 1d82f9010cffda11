"""Many keyframes at once: poses that agree, a surface for each, and what every pair has in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from covista_service.perception.adjustment import AdjustmentOptions, Link, Sighted, adjust
from covista_service.perception.agreement import AgreementOptions, DepthPoints, Observations, agree
from covista_service.perception.camera import Floats, Pose, View, relative, undistort
from covista_service.perception.depths import DepthOptions, Matched, observe
from covista_service.perception.matching import MatchingOptions, match
from covista_service.perception.relative_pose import RelativePoseOptions, relative_pose
from covista_service.perception.sightings import Sightings
from covista_service.perception.surface import Surface, SurfaceOptions, flat, interpolate
from covista_service.perception.visibility import Seeing, VisibilityOptions, seen

Pair = tuple[int, int]


@dataclass(frozen=True, slots=True)
class SceneOptions:
    """Options of all stages. `least_points`: with fewer a keyframe has no surface of its own."""

    seed: int = 0
    least_points: int = 3
    matching: MatchingOptions = field(default_factory=lambda: MatchingOptions(rootsift_ratio=0.8))
    pose: RelativePoseOptions = field(default_factory=RelativePoseOptions)
    adjustment: AdjustmentOptions = field(default_factory=AdjustmentOptions)
    depths: DepthOptions = field(default_factory=DepthOptions)
    agreement: AgreementOptions = field(default_factory=AgreementOptions)
    surface: SurfaceOptions = field(default_factory=SurfaceOptions)
    visibility: VisibilityOptions = field(default_factory=VisibilityOptions)


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """`poses` as adjusted, `surfaces` (None where nothing is known), the matched points behind each pair's depths.

    `parts` (n,): keyframes of one part are connected by matches, so that their depths have one scale.
    """

    views: tuple[View, ...]
    poses: tuple[Pose, ...]
    surfaces: tuple[Surface | None, ...]
    matched: Mapping[Pair, int]
    parts: NDArray[np.int64]
    options: SceneOptions

    def overlap(self, i: int, j: int) -> tuple[float, float] | None:
        """q_i and q_j of Eq. 16, None where a surface is missing."""
        one, other = self.surfaces[i], self.surfaces[j]
        if one is None or other is None:
            return None
        rotation, translation = relative(self.poses[i], self.poses[j])
        first, second = Seeing(self.views[i].camera, one), Seeing(self.views[j].camera, other)
        connected = bool(self.parts[i] == self.parts[j])
        options = self.options.visibility
        forth = seen(first, second, rotation, translation, options, connected=connected)
        back = seen(second, first, rotation.T, -rotation.T @ translation, options, connected=connected)
        return float(forth.mean()), float(back.mean())


def reconstruct(views: Sequence[View], pairs: Sequence[Pair], options: SceneOptions) -> Scene:
    """Match all pairs, adjust the poses, and give every keyframe the surface that all its pairs agree on."""
    ideal = [undistort(view.camera, view.features.keypoints_px) for view in views]

    # What the images of each pair alone say: matches, and a pose where they contradict the reported one ...
    free = {pair: _free(views, ideal, pair, options) for pair in pairs}
    links = {pair: link for pair, (_, link) in free.items() if link is not None}

    # ... is brought to one set of poses for all;
    keyframes = [
        Sighted(view.camera, view.pose, points, depth)
        for view, points, depth in zip(views, ideal, _depths(views, ideal, links), strict=True)
    ]
    poses = adjust(keyframes, links, options.adjustment)

    # with those, each pair gives depths to both its keyframes,
    observations: list[list[Observations]] = [[] for _ in views]
    matched: dict[Pair, int] = {}
    for (i, j), (matches, link) in free.items():
        pair = Matched((views[i], views[j]), (ideal[i], ideal[j]), matches, link is not None)
        of_first, of_second = observe(pair, *relative(poses[i], poses[j]), options.depths, options.seed)
        matched[i, j] = len(of_first)
        observations[i].append(of_first)
        observations[j].append(of_second)

    # and what all pairs of a keyframe agree on is its surface.
    points = [
        agree(said, points, view.camera.width, options.agreement)
        for said, points, view in zip(observations, ideal, views, strict=True)
    ]
    surfaces = _surfaces(views, points, pairs, options)
    return Scene(tuple(views), tuple(poses), surfaces, matched, _parts(len(views), matched), options)


def _free(
    views: Sequence[View], ideal: Sequence[Floats], pair: Pair, options: SceneOptions
) -> tuple[NDArray[np.int64], Link | None]:
    """Matches (k, 2) of a pair found without the geometry, and the link if they verify it."""
    first, second = views[pair[0]], views[pair[1]]
    if first.features.kind != second.features.kind:
        return np.zeros((0, 2), np.int64), None
    matches = match(first.features, second.features, options.matching).astype(np.int64)
    sightings = Sightings(first.camera, second.camera, ideal[pair[0]][matches[:, 0]], ideal[pair[1]][matches[:, 1]])
    pose = relative_pose(sightings, *relative(first.pose, second.pose), options.pose, options.seed)
    if not pose.verified:
        return matches, None
    link = Link(matches[pose.inliers], pose.rotation, pose.translation, pose.source == "images")
    return matches, link


def _depths(views: Sequence[View], ideal: Sequence[Floats], links: Mapping[Pair, Link]) -> list[float]:
    """Median depth of what each keyframe sees by its links and reported baselines; that of all where it has none."""
    found: list[list[Floats]] = [[] for _ in views]
    for (i, j), link in links.items():
        matched = Matched((views[i], views[j]), (ideal[i], ideal[j]), link.matches, True)
        for index, said in zip((i, j), observe(matched, link.rotation, link.translation, None, 0), strict=True):
            found[index].append(1 / said.inverse_depths)
    medians = [float(np.median(np.concatenate(one))) if sum(map(len, one)) else np.nan for one in found]
    known = [depth for depth in medians if np.isfinite(depth)]
    usual = float(np.median(known)) if known else 1.0
    return [depth if np.isfinite(depth) else usual for depth in medians]


def _surfaces(
    views: Sequence[View], points: Sequence[DepthPoints], pairs: Sequence[Pair], options: SceneOptions
) -> tuple[Surface | None, ...]:
    """Own surfaces; without points, the median inverse depth of those that a keyframe is compared with."""
    known = {
        k: float(np.median(one.inverse_depths)) for k, one in enumerate(points) if len(one) >= options.least_points
    }
    surfaces: list[Surface | None] = []
    for k, (view, one) in enumerate(zip(views, points, strict=True)):
        if k in known:
            surfaces.append(interpolate(one, view.camera, options.surface, view.thumbnail))
            continue
        others = [known[other] for pair in pairs if k in pair for other in pair if other in known]
        surfaces.append(flat(float(np.median(others))) if others else None)
    return tuple(surfaces)


def _parts(count: int, matched: Mapping[Pair, int]) -> NDArray[np.int64]:
    joined = np.array([pair for pair, points in matched.items() if points], np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(joined), np.int64), (joined[:, 0], joined[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)
