"""Swarms to group: planted groups, and similarity matrices at random."""

import numpy as np
from covista_service.grouping.similarity import closeness, similarity
from numpy.typing import NDArray
from scipy.spatial.distance import pdist, squareform

Floats = NDArray[np.float64]


def scattered(seed: int, count: int) -> Floats:
    """A similarity matrix of `count` robots in a hall, who see in common what is near, more or less."""
    rng = np.random.default_rng(seed)
    position_m = rng.uniform(0, 10, (count, 3))
    distance_m = squareform(pdist(position_m))
    overlap = np.clip(np.exp(-distance_m / 4) * rng.uniform(0.2, 1, (count, count)), 0, 1)
    return similarity(overlap, closeness(distance_m, "std"), 0.5)


def planted(seed: int, sizes: tuple[int, ...]) -> tuple[Floats, NDArray[np.intp]]:
    """A similarity matrix with clear groups of `sizes` in random order, and who belongs to which."""
    rng = np.random.default_rng(seed)
    truth = rng.permutation(np.repeat(np.arange(len(sizes)), sizes))
    same = truth[:, None] == truth
    S = np.where(same, rng.uniform(0.6, 0.9, same.shape), rng.uniform(0, 0.15, same.shape))
    S = (S + S.T) / 2
    np.fill_diagonal(S, 1.0)
    return S, truth


def together(labels: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Who stands with whom: a partition whatever its labels."""
    return labels[:, None] == labels
