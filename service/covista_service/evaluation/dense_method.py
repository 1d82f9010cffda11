"""Dense surfaces, from thumbnails: what a plane sweep adds to the surfaces that features give."""

from __future__ import annotations

import time

from covista_service.evaluation.case import Answer, Case, Pair
from covista_service.perception.dense import DenseOptions, densified
from covista_service.perception.jumps import JumpOptions, mixed
from covista_service.perception.scene import Scene, SceneOptions, reconstruct


def dense(case: Case) -> dict[Pair, Answer]:
    """A dense surface per keyframe where thumbnails are given, with poses that agree across pairs."""
    return _answers(case, at_jumps=False)


def dense_at_jumps(case: Case) -> dict[Pair, Answer]:
    """The surface of `auto`, and the dense one where depth jumps."""
    return _answers(case, at_jumps=True)


def _answers(case: Case, *, at_jumps: bool) -> dict[Pair, Answer]:
    if case.views is None:
        return dict.fromkeys(case.pairs, Answer("unknown", "no_camera"))
    start = time.perf_counter_ns()
    scene = reconstruct(case.views, case.pairs, SceneOptions())
    swept = densified(scene, DenseOptions())
    chosen = mixed(scene, swept, JumpOptions()) if at_jumps else swept
    overlaps = {pair: chosen.overlap(*pair) for pair in case.pairs}
    # Every pair costs its share of what all keyframes together took.
    ms = (time.perf_counter_ns() - start) / 1e6 / max(len(case.pairs), 1)
    return {pair: _answer(chosen, pair, overlaps[pair], ms) for pair in case.pairs}


def _answer(scene: Scene, pair: Pair, overlaps: tuple[float, float] | None, ms: float) -> Answer:
    if overlaps is None:
        return Answer("unknown", "no_depth")
    matched = scene.matched.get(pair, 0)
    if matched:
        return Answer("image", "measured", *overlaps, inliers=matched, ms=ms)
    return Answer("predicted", "predicted", *overlaps, ms=ms)
