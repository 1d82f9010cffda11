"""Many keyframes at once: poses that agree, a surface for each, and what every pair has in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.adjustment import AdjustmentOptions, Link, Sighted, adjust, to_adjust
from covista_service.perception.agreement import AgreementOptions, DepthPoints, Observations, agree
from covista_service.perception.camera import Floats, Pose, View, relative, undistort
from covista_service.perception.certainty import CertaintyOptions, Found, find
from covista_service.perception.comparison import Comparison, ComparisonOptions, compare
from covista_service.perception.depths import DepthOptions, Matched, observe
from covista_service.perception.scales import parts_of, ratio_range, scale_sigmas
from covista_service.perception.surface import Surface, SurfaceOptions, flat, interpolate
from covista_service.perception.visibility import SAME_SCALE, Seeing, VisibilityOptions
from covista_service.perception.warp import Carried

Pair = tuple[int, int]
Motion = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True)
class SceneOptions:
    """Options of all stages. `least_points`: with fewer a keyframe has no surface of its own."""

    seed: int = 0
    least_points: int = 3
    comparison: ComparisonOptions = field(default_factory=ComparisonOptions)
    adjustment: AdjustmentOptions = field(default_factory=AdjustmentOptions)
    depths: DepthOptions = field(default_factory=DepthOptions)
    agreement: AgreementOptions = field(default_factory=AgreementOptions)
    surface: SurfaceOptions = field(default_factory=SurfaceOptions)
    visibility: VisibilityOptions = field(default_factory=VisibilityOptions)
    certainty: CertaintyOptions = field(default_factory=CertaintyOptions)


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What a pair of keyframes says: free `matches` (k, 2), the `link` if they verify it, and depths.

    `observed` are the depths of either's keypoints under `motion` (R, t); None until poses are settled.
    """

    matches: NDArray[np.int64]
    link: Link | None
    motion: Motion | None = None
    observed: tuple[Observations, Observations] | None = None

    @classmethod
    def of(cls, compared: Comparison) -> Evidence:
        """What a comparison leaves to say, once poses are settled."""
        return cls(compared.matches, compared.link)

    @property
    def matched(self) -> int:
        """Matched points behind the depths."""
        return 0 if self.observed is None else len(self.observed[0])


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """A keyframe among others: `view` with its reported pose, and the `pose` that stands.

    One that is not `open` keeps its pose and its surface, and lends what it has. The reported pose of a `firm` one is
    borne out by others. `beside` are depths of its keypoints
    from keyframes that are not among the others, `former` the surface that it has, `carried` that of the robot before.
    """

    view: View
    pose: Pose
    open: bool = True
    beside: tuple[Observations, ...] = ()
    former: Surface | None = None
    carried: Carried | None = None
    firm: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """What a keyframe comes to: its pose, its surface if anything is known, and the points that it rests on.

    Without points the surface is a former one, or flat at the depth that others see.
    """

    pose: Pose
    surface: Surface | None
    points: DepthPoints


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """`settled` keyframes, and the matched points behind each pair's depths.

    `parts` (n,): keyframes of one part are connected by matches, so that their depths have one scale, which is known to
    a factor of exp(+-`scale_sigmas`).
    """

    views: tuple[View, ...]
    settled: tuple[Settled, ...]
    matched: Mapping[Pair, int]
    parts: NDArray[np.int64]
    scale_sigmas: Floats
    options: SceneOptions

    @property
    def poses(self) -> tuple[Pose, ...]:
        """Poses as adjusted."""
        return tuple(one.pose for one in self.settled)

    @property
    def surfaces(self) -> tuple[Surface | None, ...]:
        """Surfaces, None where nothing is known."""
        return tuple(one.surface for one in self.settled)

    @property
    def points(self) -> tuple[DepthPoints, ...]:
        """What the pairs of each keyframe agree on."""
        return tuple(one.points for one in self.settled)

    def with_surfaces(self, surfaces: Sequence[Surface | None]) -> Scene:
        """The same keyframes with other surfaces."""
        settled = [replace(one, surface=surface) for one, surface in zip(self.settled, surfaces, strict=True)]
        return replace(self, settled=tuple(settled))

    def overlap(self, i: int, j: int) -> tuple[float, float] | None:
        """q_i and q_j of Eq. 16, None where a surface is missing."""
        forth, back = self.found(i, j), self.found(j, i)
        return None if forth is None or back is None else (forth.overlap, back.overlap)

    def found(self, i: int, j: int) -> Found | None:
        """What j sees of i's image and how sure that is; None where a surface is missing."""
        one, other = self.surfaces[i], self.surfaces[j]
        if one is None or other is None:
            return None
        options, ratios = self.options, SAME_SCALE
        if self.parts[i] != self.parts[j]:
            ratios = ratio_range(self.scale_sigmas[i], self.scale_sigmas[j], options.visibility.scale_sigmas)
        return find(
            Seeing(self.views[i].camera, one),
            Seeing(self.views[j].camera, other),
            *relative(self.poses[i], self.poses[j]),
            options.visibility,
            options.certainty,
            matched=bool(self.matched.get((i, j)) or self.matched.get((j, i))),
            ratios=ratios,
        )


def reconstruct(views: Sequence[View], pairs: Sequence[Pair], options: SceneOptions) -> Scene:
    """Compare all pairs, and settle what that says of every keyframe."""
    evidence = {(i, j): Evidence.of(compare(views[i], views[j], options.comparison)) for i, j in pairs}
    settled, evidence = settle([Sight(view, view.pose) for view in views], evidence, options)
    matched = {pair: said.matched for pair, said in evidence.items()}
    parts = parts_of(len(views), [pair for pair, points in matched.items() if points])
    return Scene(tuple(views), tuple(settled), matched, parts, _scale_sigmas(settled, parts, options), options)


def settle(
    sights: Sequence[Sight], evidence: Mapping[Pair, Evidence], options: SceneOptions
) -> tuple[list[Settled], dict[Pair, Evidence]]:
    """What becomes of keyframes that pairs have news of, and the evidence with depths, by index of `sights`."""
    ideal = [undistort(sight.view.camera, sight.view.features.keypoints_px) for sight in sights]

    # Where the images of pairs contradict what was reported, poses are brought to agree with all of them;
    poses = _adjusted(sights, ideal, evidence, options)

    # with those, each pair gives depths to both its keyframes,
    said = {pair: _observed(pair, one, sights, ideal, poses, options) for pair, one in evidence.items()}

    # and what all pairs of a keyframe agree on is its surface.
    known = [sight.carried.points(sight.view.camera) if sight.open and sight.carried else None for sight in sights]
    points = [_points(k, sight, ideal[k], said, known[k], options) for k, sight in enumerate(sights)]
    surfaces = _surfaces(sights, points, known, said, options)
    return [Settled(*one) for one in zip(poses, surfaces, points, strict=True)], said


def _adjusted(
    sights: Sequence[Sight], ideal: Sequence[Floats], evidence: Mapping[Pair, Evidence], options: SceneOptions
) -> list[Pose]:
    links = {pair: one.link for pair, one in evidence.items() if one.link is not None}
    if not any(link.contradicts for link in links.values()):
        return [sight.pose for sight in sights]
    depths = _depths(sights, ideal, links)
    keyframes = [
        Sighted(
            sight.view.camera,
            sight.view.pose if sight.open else sight.pose,
            points,
            depth,
            held=not sight.open,
            firm=sight.firm,
        )
        for sight, points, depth in zip(sights, ideal, depths, strict=True)
    ]
    free = to_adjust(keyframes, links)
    adjusted = adjust(keyframes, links, options.adjustment)
    return [adjusted[k] if free[k] else sight.pose for k, sight in enumerate(sights)]


def _depths(sights: Sequence[Sight], ideal: Sequence[Floats], links: Mapping[Pair, Link]) -> list[float]:
    """Median depth of what each keyframe sees by its links and reported baselines; that of all where it has none."""
    found: list[list[Floats]] = [[] for _ in sights]
    for (i, j), link in links.items():
        matched = Matched((sights[i].view, sights[j].view), (ideal[i], ideal[j]), link.matches, True)
        for index, said in zip((i, j), observe(matched, link.rotation, link.translation, None, 0), strict=True):
            found[index].append(1 / said.inverse_depths)
    medians = [float(np.median(np.concatenate(one))) if sum(map(len, one)) else np.nan for one in found]
    known = [depth for depth in medians if np.isfinite(depth)]
    usual = float(np.median(known)) if known else 1.0
    return [depth if np.isfinite(depth) else usual for depth in medians]


def _observed(
    pair: Pair,
    said: Evidence,
    sights: Sequence[Sight],
    ideal: Sequence[Floats],
    poses: Sequence[Pose],
    options: SceneOptions,
) -> Evidence:
    """The evidence with depths under the poses that stand now."""
    i, j = pair
    motion, link = relative(poses[i], poses[j]), said.link
    if link is not None and link.contradicts and poses[i] is sights[i].pose and poses[j] is sights[j].pose:
        # Nobody was there to give way: the pair keeps the pose that its own images tell.
        motion = (link.rotation, link.translation)
    elif link is not None:
        # What has been brought to agree contradicts no longer.
        link = replace(link, contradicts=False)
    if said.motion is not None and all(np.array_equal(*both) for both in zip(said.motion, motion, strict=True)):
        return said
    matched = Matched((sights[i].view, sights[j].view), (ideal[i], ideal[j]), said.matches, said.link is not None)
    return Evidence(said.matches, link, motion, observe(matched, *motion, options.depths, options.seed))


def _points(
    k: int,
    sight: Sight,
    ideal: Floats,
    evidence: Mapping[Pair, Evidence],
    known: DepthPoints | None,
    options: SceneOptions,
) -> DepthPoints:
    said = [one.observed[pair.index(k)] for pair, one in evidence.items() if k in pair and one.observed is not None]
    if not sight.open:
        said = []
    return agree([*said, *sight.beside], ideal, sight.view.camera.width, options.agreement, known)


def _surfaces(
    sights: Sequence[Sight],
    points: Sequence[DepthPoints],
    known: Sequence[DepthPoints | None],
    pairs: Mapping[Pair, Evidence],
    options: SceneOptions,
) -> list[Surface | None]:
    """Own surfaces, with what was carried over where that is not told anew; without either, the former one.

    Else the median inverse depth of those that a keyframe is compared with.
    """
    medians = {k: depth for k, sight in enumerate(sights) if (depth := _median(sight, points[k], options)) is not None}
    surfaces: list[Surface | None] = []
    for k, (sight, own, carried) in enumerate(zip(sights, points, known, strict=True)):
        surface, told = sight.former, own if carried is None else own.beside(carried)
        if sight.open and len(told) >= options.least_points:
            surface = interpolate(told, sight.view.camera, options.surface, sight.view.thumbnail)
        if surface is None:
            others = [medians[other] for pair in pairs if k in pair for other in pair if other in medians]
            surface = flat(float(np.median(others))) if others else None
        surfaces.append(surface)
    return surfaces


def _median(sight: Sight, points: DepthPoints, options: SceneOptions) -> float | None:
    """Median inverse depth of what a keyframe sees."""
    if len(points) >= options.least_points:
        return float(np.median(points.inverse_depths))
    return None if sight.former is None else float(np.median(sight.former.inverse_depth))


def _scale_sigmas(settled: Sequence[Settled], parts: NDArray[np.int64], options: SceneOptions) -> Floats:
    centres = np.array([one.pose.centre_m for one in settled]).reshape(-1, 3)
    surfaces = [one.surface for one in settled]
    depths = np.array([np.nan if one is None else 1 / np.median(one.inverse_depth) for one in surfaces])
    return scale_sigmas(centres, depths, parts, options.adjustment.position_share)
