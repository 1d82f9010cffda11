"""Overlaps on known planes for new poses."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from covista_service.bench import plane_scenes
from covista_service.bench.row import Row, median, spread
from covista_service.bench.threads import one_thread
from covista_service.perception.overlap import common_field
from covista_service.perception.prediction import PosedPairs, overlaps, posed_pairs

PEER = "one pair at a time, common_field"
MARK_PER_S = 50_000.0
_PAIRS = 2_000
_ROUNDS, _LONG_ROUNDS = 15, 60
_PEER_PAIRS = 50


def rows(long: bool) -> Iterator[Row]:
    """`predict/planes`: ordered pairs a second, each on up to three planes of its own first camera."""
    pairs = _pairs()
    with one_thread():
        overlaps(pairs)
        rates, peers = [], []
        for _ in range(_LONG_ROUNDS if long else _ROUNDS):
            start = time.perf_counter_ns()
            overlaps(pairs)
            rates.append(_PAIRS * 1e9 / (time.perf_counter_ns() - start))
            start = time.perf_counter_ns()
            _one_by_one(pairs, _PEER_PAIRS)
            peers.append(_PEER_PAIRS * 1e9 / (time.perf_counter_ns() - start))
    yield Row(
        bench="predict",
        case="planes",
        median=median(rates),
        spread=spread(rates),
        unit="ordered pairs/s",
        peer=PEER,
        peer_median=median(peers),
        mark=f">= {MARK_PER_S:,.0f} ordered pairs/s",
        holds=median(rates) >= MARK_PER_S,
    )


def _pairs() -> PosedPairs:
    """Scenes in turn, each with a new pose; only one of the two shares that come out is counted."""
    random = np.random.default_rng(0)
    scenes = [plane_scenes.draw(name, 0, 0, random) for name in plane_scenes.SCENES for _ in range(5)]
    poses = [plane_scenes.moved(random) for _ in range(_PAIRS)]
    camera = plane_scenes.CAMERA
    return posed_pairs(
        [(camera, camera)] * _PAIRS,
        np.array([rotation for rotation, _ in poses]),
        np.array([translation for _, translation in poses]),
        [scenes[i % len(scenes)].planes for i in range(_PAIRS)],
    )


def _one_by_one(pairs: PosedPairs, count: int) -> None:
    camera = plane_scenes.CAMERA
    for i in range(count):
        begin, end = pairs.slices[i]
        common_field(camera, camera, pairs.rotations[i], pairs.translations[i], pairs.planes[begin:end])
