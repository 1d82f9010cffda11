"""What surfaces answer: those that features give, with and without thumbnails, and those that a sweep gives."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from covista_service.evaluation.case import NO_CAMERA, NO_DEPTH, Answer, Case, Pair
from covista_service.perception.camera import View
from covista_service.perception.dense import DenseOptions, densified
from covista_service.perception.jumps import JumpOptions, mixed
from covista_service.perception.scene import Scene, SceneOptions, reconstruct


def surfaces(case: Case) -> dict[Pair, Answer]:
    """A surface per keyframe from the features of all its pairs, with poses that agree across pairs."""
    if case.views is None:
        return dict.fromkeys(case.pairs, NO_CAMERA)
    return _answers([replace(view, thumbnail=None) for view in case.views], case.pairs)


def auto(case: Case) -> dict[Pair, Answer]:
    """Surfaces, with the thumbnail's grey where there is one."""
    return dict.fromkeys(case.pairs, NO_CAMERA) if case.views is None else _answers(case.views, case.pairs)


def dense(case: Case) -> dict[Pair, Answer]:
    """A dense surface per keyframe where thumbnails are given, with poses that agree across pairs."""
    if case.views is None:
        return dict.fromkeys(case.pairs, NO_CAMERA)
    return _answers(case.views, case.pairs, lambda scene: densified(scene, DenseOptions()))


def dense_at_jumps(case: Case) -> dict[Pair, Answer]:
    """The surface of `auto`, and the dense one where depth jumps."""
    if case.views is None:
        return dict.fromkeys(case.pairs, NO_CAMERA)
    return _answers(case.views, case.pairs, lambda scene: mixed(scene, densified(scene, DenseOptions()), JumpOptions()))


def _answers(
    views: Sequence[View], pairs: Sequence[Pair], refine: Callable[[Scene], Scene] = lambda scene: scene
) -> dict[Pair, Answer]:
    """Every pair costs its share of what all keyframes together took."""
    start = time.perf_counter_ns()
    scene = refine(reconstruct(views, pairs, SceneOptions()))
    answers = {pair: _answer(scene, pair) for pair in pairs}
    ms = (time.perf_counter_ns() - start) / 1e6 / max(len(pairs), 1)
    return {pair: replace(answer, ms=ms) for pair, answer in answers.items()}


def _answer(scene: Scene, pair: Pair) -> Answer:
    a, b = scene.found(*pair), scene.found(*pair[::-1])
    if a is None or b is None:
        return NO_DEPTH
    said = (a.overlap, b.overlap, a.interval, b.interval)
    matched = scene.matched.get(pair, 0)
    return Answer("image", "measured", *said, inliers=matched) if matched else Answer("predicted", "predicted", *said)
