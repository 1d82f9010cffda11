"""Stocks that cost nothing: features are drawn, not seen."""

import numpy as np
from covista_clients.simulation.stock import Shot, Stock, StockOptions
from covista_clients.simulation.viewing import facing, pinhole
from covista_schemas.messages import FeatureKind, Features

FEATURES = 20
SIDE_M = 24.0
# As a stock keeps them: tracks have eight poses a step.
BETWEEN = 8


def drawn(robots: int = 6, steps: int = 4, seed: int = 0, thumbnail: bytes | None = None) -> Stock:
    """A stock of robots that drive straight ahead from places drawn in a square, turning a little."""
    rng = np.random.default_rng(seed)
    camera = pinhole(320, 240)
    moments = np.arange((steps - 1) * BETWEEN + 1) / BETWEEN
    starts = rng.uniform(2, SIDE_M - 2, (robots, 2)).tolist()
    tracks = tuple(
        tuple(
            (pose.position_m, pose.orientation_xyzw)
            for pose in (facing((x + 0.1 * t, y, 1.0), 0.05 * t, 0.0) for t in moments.tolist())
        )
        for x, y in starts
    )
    shots = tuple(tuple(_shot(rng, thumbnail) for _ in range(steps)) for _ in range(robots))
    options = StockOptions(robots=robots, steps=steps, features=FEATURES)
    return Stock(options, camera, np.zeros(2), np.full(2, SIDE_M), tracks, shots)


def _shot(rng: np.random.Generator, thumbnail: bytes | None) -> Shot:
    points = rng.uniform(0, 200, (FEATURES, 2)).astype(np.float32)
    descriptors = rng.integers(0, 128, (FEATURES, 128)).astype(np.uint8)
    return Shot(Features(FeatureKind.ROOTSIFT, points, descriptors), thumbnail)
