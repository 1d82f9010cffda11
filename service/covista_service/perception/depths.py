"""The depths that one pair gives its two keyframes: matches along epipolar lines, triangulated both ways, sifted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.agreement import Observations
from covista_service.perception.camera import Floats, View
from covista_service.perception.epipolar import fundamental, homogeneous, residuals
from covista_service.perception.guided import Directions, GuidedOptions, guided_matches
from covista_service.perception.nearest import nearest
from covista_service.perception.sightings import Sightings
from covista_service.perception.triangulation import TriangulationOptions, triangulate

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class DepthOptions:
    """A match is free if it lies within `inlier_px` of its epipolar line unguided.

    A point stays if at least `agreeing` of its `neighbours`, `apart_px` off or more, have its inverse depth, to within
    `tolerance` and `sigmas` of the difference, and sigma is less than the inverse depth. Guided points lie within the
    range of the free ones, widened by `widened`.
    """

    inlier_px: float = 2.0
    neighbours: int = 8
    agreeing: int = 3
    tolerance: float = 0.10
    sigmas: float = 2.0
    apart_px: float = 0.5
    widened: float = 3.0
    least_free: int = 8
    guided: GuidedOptions = field(default_factory=GuidedOptions)


@dataclass(frozen=True, slots=True, eq=False)
class Matched:
    """A pair: views, all keypoints (n, 2) of either in ideal px, free matches (k, 2), and whether they verify it."""

    views: tuple[View, View]
    ideal_px: tuple[Floats, Floats]
    matches: NDArray[np.int64]
    verified: bool


def observe(
    pair: Matched, rotation: Floats, translation: Floats, options: DepthOptions | None, seed: int
) -> tuple[Observations, Observations]:
    """Depths of the first and of the second keyframe's keypoints, for X_2 = R X_1 + t.

    Without `options` of the free matches alone, as they are. A pair that free matches do not verify counts only if the
    geometry finds far more matches than chance would.
    """
    if not np.linalg.norm(translation):
        return _nothing(), _nothing()
    matches, free = pair.matches, np.ones(len(pair.matches), np.bool_)
    if options is not None:
        matches, free = _with_guided(
            pair, fundamental(pair.views[0].camera, pair.views[1].camera, rotation, translation), options, seed
        )
    back = (rotation.T, -rotation.T @ translation)
    both = [
        _observed(pair, matches, free, side, *motion, options)
        for side, motion in ((0, (rotation, translation)), (1, back))
    ]
    return both[0], both[1]


def _with_guided(pair: Matched, F: Floats, options: DepthOptions, seed: int) -> tuple[NDArray[np.int64], Mask]:
    """Free matches that fit the geometry, then those that only the geometry found; none if it may be chance."""
    one, other = (homogeneous(points[pair.matches[:, k]]) for k, points in enumerate(pair.ideal_px))
    fits = np.abs(residuals(F, one, other)[0]) < options.inlier_px
    free = pair.matches[fits]
    guided = _guided(pair, F, options, pair.ideal_px[1])
    if not pair.verified:
        if len(guided) <= options.guided.chance_margin:
            return free[:0], np.zeros(0, np.bool_)
        shuffled = np.random.default_rng(seed).permutation(pair.ideal_px[1])
        chance = len(_guided(pair, F, options, shuffled))
        if len(guided) <= options.guided.chance_factor * chance + options.guided.chance_margin:
            return free[:0], np.zeros(0, np.bool_)
    # A keypoint that is there twice, with two orientations, must not bear itself out.
    new = ~(np.isin(guided[:, 0], free[:, 0]) | np.isin(guided[:, 1], free[:, 1]))
    matches = np.concatenate((free, guided[new]))
    return matches, np.arange(len(matches)) < len(free)


def _guided(pair: Matched, F: Floats, options: DepthOptions, second_px: Floats) -> NDArray[np.int64]:
    first, second = (view.features for view in pair.views)
    if first.kind != second.kind:
        return pair.matches[:0]
    return guided_matches(pair.ideal_px[0], Directions.of(first), second_px, Directions.of(second), F, options.guided)


def _observed(
    pair: Matched,
    matches: NDArray[np.int64],
    free: Mask,
    side: int,
    rotation: Floats,
    translation: Floats,
    options: DepthOptions | None,
) -> Observations:
    """Depths in one keyframe's own frame, with a sigma of one pixel along the epipolar line."""
    here, there = side, 1 - side
    sightings = Sightings(
        pair.views[here].camera,
        pair.views[there].camera,
        pair.ideal_px[here][matches[:, here]],
        pair.ideal_px[there][matches[:, there]],
    )
    points = triangulate(sightings, rotation, translation, TriangulationOptions(reprojection_px=3.0))
    sigmas = 1 / np.maximum(points.shifts_px, 1e-12)
    kept = points.kept & (sigmas < points.inverse_depths)
    said = Observations(matches[:, here], points.inverse_depths, sigmas, free).only(kept)
    if options is None:
        return said
    said = _in_range(said, options)
    return said.only(_neighbourly(pair.ideal_px[here][said.keypoints], said, options))


def _in_range(said: Observations, options: DepthOptions) -> Observations:
    if said.free.sum() < options.least_free:
        return said
    low, high = np.percentile(said.inverse_depths[said.free], (5, 95))
    within = (said.inverse_depths > low / options.widened) & (said.inverse_depths < high * options.widened)
    return said.only(within | said.free)


def _neighbourly(positions: Floats, said: Observations, options: DepthOptions) -> Mask:
    """Which points (n,) have enough neighbours of their depth, or nothing but such where there are fewer."""
    count = min(2 * options.neighbours + 1, len(said))
    if count < 2:
        return np.ones(len(said), np.bool_)
    distance, index = nearest(positions, positions, count)
    # A keypoint with two orientations is there twice, and no witness for itself.
    elsewhere = distance > options.apart_px
    elsewhere &= np.cumsum(elsewhere, axis=1) <= options.neighbours
    room = options.tolerance * said.inverse_depths[:, None]
    room = room + options.sigmas * np.hypot(said.sigmas[:, None], said.sigmas[index])
    close = elsewhere & (np.abs(said.inverse_depths[index] - said.inverse_depths[:, None]) < room)
    return np.asarray(close.sum(axis=1) >= np.minimum(options.agreeing, elsewhere.sum(axis=1)), np.bool_)


def _nothing() -> Observations:
    return Observations(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0, np.bool_))
