"""How often are the planes of a scene found, among noise and outliers, and how often by sequential MSAC?"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from scipy.optimize import linear_sum_assignment

from covista_service.bench.plane_scenes import SCENES, PlaneScene, draw
from covista_service.bench.row import Row
from covista_service.perception.camera import Floats
from covista_service.perception.comparators import msac
from covista_service.perception.planes import PlaneOptions, find_planes

PEER = "sequential MSAC"
# Percentages of the matches, and px in each coordinate.
OUTLIERS, LONG_OUTLIERS = (20, 40), (0, 10, 20, 30, 40)
NOISE_PX, LONG_NOISE_PX = (0.5, 1.0), (0.0, 0.5, 1.0, 2.0)
DRAWS, LONG_DRAWS = 60, 100
# A share of draws is off by some .06: less behind is no difference.
_TIE = 0.05
_RIGHT_DEG = 5.0
_SEED = 1


def rows(long: bool) -> Iterator[Row]:
    """`planes/SCENE_%out_PXpx`: share of draws with as many planes as there are, each with the right normal."""
    outliers, noise_px = (LONG_OUTLIERS, LONG_NOISE_PX) if long else (OUTLIERS, NOISE_PX)
    for scene, percent, px in product(SCENES, outliers, noise_px):
        yield _row(scene, percent, px, LONG_DRAWS if long else DRAWS)


def _row(scene: str, percent: int, noise_px: float, draws: int) -> Row:
    random = np.random.default_rng((_SEED, list(SCENES).index(scene), percent, int(10 * noise_px)))
    scenes = [draw(scene, percent / 100, noise_px, random) for _ in range(draws)]
    options = PlaneOptions()
    ours = float(np.mean([right(one, find_planes(one.points, options, 0).normals) for one in scenes]))
    peer = float(np.mean([right(one, msac.find_planes(one.points, options, 0).normals) for one in scenes]))
    return Row(
        bench="planes",
        case=f"{scene}_{percent}out_{noise_px:g}px",
        median=ours,
        spread=None,
        unit="of draws",
        peer=PEER,
        peer_median=peer,
        mark=f">= peer - {_TIE:g}",
        holds=ours >= peer - _TIE,
    )


def right(scene: PlaneScene, normals: Floats) -> bool:
    """Are planes u (K', 3) as many as there are, each within `_RIGHT_DEG` of a true one of its own?"""
    if len(normals) != len(scene.planes):
        return False
    angles = np.degrees(np.arccos(np.clip(_unit(scene.planes) @ _unit(normals).T, -1, 1)))
    return bool(angles[linear_sum_assignment(angles)].max() <= _RIGHT_DEG)


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit
