"""How long is the dense surface of a keyframe, from thumbnails?"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from covista_service.bench.row import Row, alternately_ms, median, spread
from covista_service.bench.scene import company
from covista_service.bench.threads import one_thread
from covista_service.perception.dense import DenseOptions, densified
from covista_service.perception.scene import SceneOptions, reconstruct

MARK_MS = 25.0
_FEATURES = 500
_ROUNDS, _LONG_ROUNDS = 15, 80


def rows(long: bool) -> Iterator[Row]:
    """`survey/dense`: neighbours, sweep, confirmation and surface of a keyframe among several, one core."""
    with one_thread():
        views = company(_FEATURES)
        scene = reconstruct(views, list(combinations(range(len(views)), 2)), SceneOptions())
        (times,) = alternately_ms([lambda: densified(scene, DenseOptions())], _LONG_ROUNDS if long else _ROUNDS)
    each = [ms / len(views) for ms in times]
    yield Row(
        bench="survey",
        case="dense",
        median=median(each),
        spread=spread(each),
        unit="ms",
        peer=None,
        peer_median=None,
        mark=f"<= {MARK_MS:g} ms",
        holds=median(each) <= MARK_MS,
    )
