"""Ways to say how much two images have in common, by name; a new one joins by its line in `METHODS`."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np

from covista_service.evaluation import comparing
from covista_service.evaluation.case import NO_CAMERA, NO_DEPTH, Answer, Case, Pair, connected
from covista_service.evaluation.surfaces import auto, dense, dense_at_jumps, surfaces
from covista_service.perception import frustum
from covista_service.perception.camera import Floats, View
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
