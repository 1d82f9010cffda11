"""How many overlaps can be read a second from known surfaces at new poses?"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, permutations

import numpy as np

from covista_service.bench.row import Row, alternately_ms, median, spread
from covista_service.bench.scene import views
from covista_service.bench.threads import one_thread
from covista_service.perception.camera import relatives
from covista_service.perception.scene import Scene, SceneOptions, reconstruct
from covista_service.perception.visibility import SAME_SCALE, Gallery, Seeing, seen_shares

MARK_PER_S = 30_000.0
_FEATURES = 500
_AT_ONCE = 1000
_ANY_RATIO = (0.1, 10.0)
_ROUNDS, _LONG_ROUNDS = 20, 200


def rows(long: bool) -> Iterator[Row]:
    """`predict/surfaces`: ordered pairs that see something of each other, many in one call, on one core."""
    seen = views(_FEATURES)
    scene = reconstruct(seen, list(combinations(range(len(seen)), 2)), SceneOptions())
    with one_thread():
        yield _surfaces(scene, _LONG_ROUNDS if long else _ROUNDS)


def _surfaces(scene: Scene, rounds: int) -> Row:
    with_surface = [k for k, surface in enumerate(scene.surfaces) if surface is not None]
    gallery = Gallery.of(
        [Seeing(scene.views[k].camera, surface) for k, surface in enumerate(scene.surfaces) if surface is not None]
    )
    poses = [scene.poses[k] for k in with_surface]

    def read(pairs: np.ndarray) -> np.ndarray:
        connected = scene.parts[with_surface][pairs]
        same = (connected[:, 0] == connected[:, 1])[:, None]
        ratios = np.where(same, SAME_SCALE, _ANY_RATIO)
        return seen_shares(gallery, pairs, *relatives(poses, pairs), ratios, scene.options.visibility)

    pairs = np.array(list(permutations(range(len(poses)), 2)))
    meeting = np.resize(pairs[read(pairs) > 0], (_AT_ONCE, 2))
    (times,) = alternately_ms([lambda: read(meeting)], rounds)
    per_s = [_AT_ONCE / taken * 1e3 for taken in times]
    return Row(
        bench="predict",
        case="surfaces",
        median=median(per_s),
        spread=spread(per_s),
        unit="pairs/s",
        peer=None,
        peer_median=None,
        mark=f">= {MARK_PER_S:g} pairs/s",
        holds=median(per_s) >= MARK_PER_S,
    )
