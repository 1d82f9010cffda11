"""Ways to say how much two images have in common, by name; a new one joins by its line in `METHODS`."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from covista_service.evaluation import comparing
from covista_service.evaluation.case import NO_CAMERA, NO_DEPTH, Answer, Case, Pair, connected
from covista_service.evaluation.dense_method import dense, dense_at_jumps
from covista_service.perception import frustum
from covista_service.perception.camera import Floats, View
from covista_service.perception.certainty import Found
from covista_service.perception.scene import SceneOptions, reconstruct
from covista_service.perception.survey import Outcome, Survey

Method = Callable[[Case], dict[Pair, Answer]]


def planes(case: Case) -> dict[Pair, Answer]:
    """Planes of the pair, cut into exact polygons: what the survey of each pair alone says."""
    answers = {pair: _planes(timed.survey, timed.ms) for pair, timed in case.surveys.items()}
    return {pair: answers.get(pair, NO_CAMERA) for pair in case.pairs}


def frustums(case: Case) -> dict[Pair, Answer]:
    """View frusta alone: each image taken for a plane, parallel to it, at its median depth over all its pairs."""
    if case.views is None:
        return dict.fromkeys(case.pairs, NO_CAMERA)
    depths = _median_depths(case)
    return {
        # Depths come from the surveys, which is where the time goes.
        (a, b): _frustum(case.views[a], depths.get(a), case.views[b], depths.get(b), case.surveys[a, b].ms)
        for a, b in case.pairs
    }


def surfaces(case: Case) -> dict[Pair, Answer]:
    """A surface per keyframe from the features of all its pairs, with poses that agree across pairs."""
    if case.views is None:
        return dict.fromkeys(case.pairs, NO_CAMERA)
    return _surfaces([replace(view, thumbnail=None) for view in case.views], case.pairs)


def auto(case: Case) -> dict[Pair, Answer]:
    """Surfaces, with the thumbnail's grey where there is one."""
    return dict.fromkeys(case.pairs, NO_CAMERA) if case.views is None else _surfaces(case.views, case.pairs)


METHODS: Mapping[str, Method] = {
    "auto": auto,
    "planes": planes,
    "surface": surfaces,
    "frustum": frustums,
    "snavely": comparing.snavelys,
    "bruckner": comparing.bruckners,
    "coslam": comparing.coslams,
    "hull": comparing.hulls,
    "distance": comparing.distances,
    "dense": dense,
    "dense_at_jumps": dense_at_jumps,
}


def _surfaces(views: Sequence[View], pairs: Sequence[Pair]) -> dict[Pair, Answer]:
    """Every pair costs its share of what all keyframes together took."""
    start = time.perf_counter_ns()
    scene = reconstruct(views, pairs, SceneOptions())
    found = {(a, b): (scene.found(a, b), scene.found(b, a)) for a, b in pairs}
    ms = (time.perf_counter_ns() - start) / 1e6 / max(len(pairs), 1)
    return {pair: _surface(*found[pair], scene.matched.get(pair, 0), ms) for pair in pairs}


def _surface(a: Found | None, b: Found | None, matched: int, ms: float) -> Answer:
    if a is None or b is None:
        return NO_DEPTH
    said = (a.overlap, b.overlap, a.interval, b.interval)
    if matched:
        return Answer("image", "measured", *said, inliers=matched, ms=ms)
    return Answer("predicted", "predicted", *said, ms=ms)


def _planes(found: Survey, ms: float) -> Answer:
    measured = found.overlap_first is not None
    return Answer(
        found_by="image" if measured else "unknown",
        outcome=str(found.outcome),
        overlap_a=found.overlap_first,
        overlap_b=found.overlap_second,
        inliers=found.inliers,
        planes=len(found.planes),
        ms=ms,
    )


def _frustum(
    first: View, first_depth: float | None, second: View, second_depth: float | None, survey_ms: float
) -> Answer:
    if first_depth is None or second_depth is None:
        return NO_DEPTH
    start = time.perf_counter_ns()
    overlap_a, overlap_b = frustum.overlap(
        first.camera, first.pose, first_depth, second.camera, second.pose, second_depth
    )
    ms = survey_ms + (time.perf_counter_ns() - start) / 1e6
    return Answer("predicted", "predicted", overlap_a, overlap_b, ms=ms)


def _median_depths(case: Case) -> dict[int, float]:
    """Median depth of each image's points over all its measured pairs; else that of the set it is connected to."""
    seen: dict[int, list[Floats]] = {}
    for (a, b), timed in case.surveys.items():
        if timed.survey.outcome is Outcome.MEASURED:
            seen.setdefault(a, []).append(timed.survey.depths_first)
            seen.setdefault(b, []).append(timed.survey.depths_second)
    own = {index: float(np.median(np.concatenate(depths))) for index, depths in seen.items()}
    medians = dict(own)
    for part in connected(case.pairs):
        known = [own[index] for index in part if index in own]
        if known:
            medians.update({index: float(np.median(known)) for index in part if index not in own})
    return medians
