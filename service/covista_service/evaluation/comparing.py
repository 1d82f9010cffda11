"""What others' measures answer when they are asked for an overlap: their similarities as they are, from 0 to 1."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from covista_service.evaluation.case import NO_CAMERA, NO_DEPTH, Answer, Case, Pair, TimedSurvey, connected
from covista_service.grouping.similarity import closeness, standard_sigma_m
from covista_service.perception.camera import Floats, View, relative, undistort
from covista_service.perception.comparators import bruckner, coslam, hull, snavely
from covista_service.perception.comparators.image import Image, image_of
from covista_service.perception.epipolar import homogeneous

KINDS_DIFFER = Answer("unknown", "kinds_differ")

# Overlaps of the first and the second image, and the number of matches behind them.
_Said = tuple[float, float, int]


def snavelys(case: Case) -> dict[Pair, Answer]:
    """Verified matches over the features of the poorer image (Snavely et al. 2008)."""

    def said(first: Image, second: Image) -> _Said:
        inliers = len(snavely.verified(first, second))
        similarity = snavely.similarity(inliers, first, second)
        return similarity, similarity, inliers

    return _by_images(case, said)


def bruckners(case: Case) -> dict[Pair, Answer]:
    """Entropy of who matches whom (after Brückner et al. 2009)."""

    def said(first: Image, second: Image) -> _Said:
        similarity = bruckner.entropy_similarity(first.features, second.features)
        return similarity, similarity, 0

    return _by_images(case, said)


def hulls(case: Case) -> dict[Pair, Answer]:
    """Area of the convex hull of the matched features."""
    return _by_images(case, hull.overlap)


def coslams(case: Case) -> dict[Pair, Answer]:
    """Features of an image inside the hull of what the other has mapped with all its pairs (Zou and Tan 2013)."""
    if case.views is None:
        return dict.fromkeys(case.pairs, NO_CAMERA)
    views, maps = case.views, _maps(case.views, case.surveys)
    return {
        (a, b): _coslam((views[a], views[b]), (maps.get(a), maps.get(b)), case.surveys[a, b]) for a, b in case.pairs
    }


def distances(case: Case) -> dict[Pair, Answer]:
    """Closeness of Eq. 15 alone: sigma is the standard deviation of the distances of all that are compared."""
    if case.views is None:
        return dict.fromkeys(case.pairs, NO_CAMERA)
    start = time.perf_counter_ns()
    near: dict[Pair, float] = {}
    for group in connected(case.pairs):
        members = sorted(group)
        centres = np.array([case.views[index].pose.centre_m for index in members])
        distance_m = np.linalg.norm(centres[:, None] - centres, axis=2)
        matrix = closeness(distance_m, standard_sigma_m(distance_m))
        near.update({(a, b): float(matrix[i, j]) for i, a in enumerate(members) for j, b in enumerate(members)})
    ms = _ms(start) / max(len(case.pairs), 1)
    return {pair: Answer("predicted", "predicted", near[pair], near[pair], ms=ms) for pair in case.pairs}


def _by_images(case: Case, said: Callable[[Image, Image], _Said]) -> dict[Pair, Answer]:
    """Answers of a measure that needs neither cameras nor poses."""
    images = case.images or tuple(image_of(view) for view in case.views or ())
    if not images:
        return dict.fromkeys(case.pairs, NO_CAMERA)
    return {(a, b): _by_image(images[a], images[b], said) for a, b in case.pairs}


def _by_image(first: Image, second: Image, said: Callable[[Image, Image], _Said]) -> Answer:
    if first.features.kind != second.features.kind:
        return KINDS_DIFFER
    start = time.perf_counter_ns()
    overlap_a, overlap_b, inliers = said(first, second)
    return Answer("image", "measured", overlap_a, overlap_b, inliers=inliers, ms=_ms(start))


def _maps(views: Sequence[View], surveys: Mapping[Pair, TimedSurvey]) -> dict[int, Floats]:
    """Points (n, 3) of each image in its own frame, triangulated with all its pairs."""
    maps: dict[int, list[Floats]] = {}
    for (a, b), timed in surveys.items():
        found = timed.survey
        if len(found.points_first_px):
            maps.setdefault(a, []).append(_points(views[a], found.points_first_px, found.depths_first))
            maps.setdefault(b, []).append(_points(views[b], found.points_second_px, found.depths_second))
    return {index: np.concatenate(points) for index, points in maps.items()}


def _points(view: View, points_px: Floats, depths: Floats) -> Floats:
    points: Floats = depths[:, None] * (homogeneous(points_px) @ view.camera.rays_from_pixels.T)
    return points


def _coslam(views: tuple[View, View], maps: tuple[Floats | None, Floats | None], timed: TimedSurvey) -> Answer:
    (first, second), (of_first, of_second) = views, maps
    if of_first is None or of_second is None:
        return NO_DEPTH
    start = time.perf_counter_ns()
    overlap_a = coslam.share(_look(first, second, of_second))
    overlap_b = coslam.share(_look(second, first, of_first))
    # Maps come from the surveys, which is where the time goes.
    ms = timed.ms + _ms(start)
    return Answer("predicted", "predicted", overlap_a, overlap_b, inliers=timed.survey.inliers, ms=ms)


def _look(view: View, other: View, mapped: Floats) -> coslam.Look:
    """How a view sees points (n, 3) in the other's frame."""
    rotation, translation = relative(other.pose, view.pose)
    features_px = undistort(view.camera, view.features.keypoints_px)
    return coslam.look(mapped @ rotation.T + translation, view.camera, features_px)


def _ms(start_ns: int) -> float:
    return (time.perf_counter_ns() - start_ns) / 1e6
