"""Swarms of known overlap, without a scene."""

from __future__ import annotations

import numpy as np
from covista_service.evaluation.planted.swarm import Swarm


def clear(sizes: tuple[int, ...], apart_m: float = 20.0, seed: int = 0) -> Swarm:
    """Groups that stand far from one another, share all among themselves, and nothing with others."""
    rng = np.random.default_rng(seed)
    truth = rng.permutation(np.repeat(np.arange(len(sizes)), sizes))
    positions = np.column_stack([apart_m * truth, np.zeros((len(truth), 2))]) + rng.normal(0, 0.3, (len(truth), 3))
    overlap = np.where(truth[:, None] == truth, 0.8, 0.0)
    np.fill_diagonal(overlap, 1.0)
    return Swarm(positions, overlap, overlap > 0, truth, "ground", seed)
