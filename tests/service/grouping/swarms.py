"""Swarms to group: planted groups, similarity matrices at random, and all the ways to part a few robots."""

from collections.abc import Iterator
from functools import cache

import numpy as np
from covista_service.grouping.similarity import matrix
from numpy.typing import NDArray
from scipy.spatial.distance import pdist, squareform

Floats = NDArray[np.float64]
Labels = NDArray[np.intp]


def distances(position_m: Floats) -> Floats:
    """Distances (N, N) of robots at `position_m` (N, 3)."""
    return squareform(pdist(position_m)) if len(position_m) > 1 else np.zeros((len(position_m), len(position_m)))


def scattered(seed: int, count: int) -> Floats:
    """A similarity matrix of `count` robots in a hall, who see in common what is near, more or less."""
    rng = np.random.default_rng(seed)
    distance_m = distances(rng.uniform(0, 10, (count, 3)))
    overlap = np.clip(np.exp(-distance_m / 4) * rng.uniform(0.2, 1, (count, count)), 0, 1)
    return matrix(distance_m, overlap, 0.5, "std")


def planted(
    seed: int, sizes: tuple[int, ...], inside: tuple[float, float] = (0.6, 0.9), across: tuple[float, float] = (0, 0.15)
) -> tuple[Floats, Labels]:
    """A similarity matrix with clear groups of `sizes` in random order, and who belongs to which."""
    rng = np.random.default_rng(seed)
    truth = rng.permutation(np.repeat(np.arange(len(sizes)), sizes))
    same = truth[:, None] == truth
    return _mirrored(np.where(same, rng.uniform(*inside, same.shape), rng.uniform(*across, same.shape))), truth


def jumbled(seed: int, count: int, most: float = 1.0) -> Floats:
    """A similarity matrix of `count` robots without any order in it, from 0 to `most`."""
    return _mirrored(np.random.default_rng(seed).uniform(0, most, (count, count)))


def alike(count: int, weight: float) -> Floats:
    """Everybody has `weight` in common with everybody."""
    S = np.full((count, count), weight)
    np.fill_diagonal(S, 1.0)
    return S


def together(labels: Labels) -> NDArray[np.bool_]:
    """Who stands with whom: a partition whatever its labels."""
    return labels[:, None] == labels


def reordered(matrix: Floats, order: Labels) -> Floats:
    """The same matrix (N, N) with its robots in another order."""
    return np.ascontiguousarray(matrix[np.ix_(order, order)])


@cache
def partitions(count: int, m: int) -> NDArray[np.intp]:
    """All partitions of `count` robots into m groups, one a row: labels as they first appear."""

    def grow(prefix: list[int]) -> Iterator[list[int]]:
        used = max(prefix) + 1
        if m - used > count - len(prefix):
            return
        if len(prefix) == count:
            yield prefix
            return
        for label in range(min(used + 1, m)):
            yield from grow([*prefix, label])

    return np.array(list(grow([0])))


@cache
def all_partitions(count: int) -> NDArray[np.intp]:
    """All partitions of `count` robots, one a row."""
    return np.concatenate([partitions(count, m) for m in range(1, count + 1)])


def members(labels: NDArray[np.intp]) -> Floats:
    """One-hot (..., M, N) of labels (..., N): who belongs to which group."""
    return (labels[..., None, :] == np.arange(labels.max() + 1)[:, None]).astype(np.float64)


def _mirrored(S: Floats) -> Floats:
    S = (S + S.T) / 2
    np.fill_diagonal(S, 1.0)
    return S
