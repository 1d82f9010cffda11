"""Correspondences between the features of two images: mutual nearest neighbours that stand out from the second best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Features

Descriptors = NDArray[np.uint8]
Distances = NDArray[np.float32]
Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class MatchingOptions:
    """`ratio` of the best to the second best distance (Lowe, IJCV 2004) that a match may have at most."""

    rootsift_ratio: float = 0.9
    orb_ratio: float = 0.85


def match(first: Features, second: Features, options: MatchingOptions) -> Indices:
    """Indices (k, 2) of matching keypoints of two sets of one kind; each keypoint at most once."""
    if not len(first.descriptors) or not len(second.descriptors):
        return np.zeros((0, 2), np.intp)
    if first.kind == "rootsift":
        return mutual(_squared_distances(first.descriptors, second.descriptors), options.rootsift_ratio**2)
    return mutual(_hamming_distances(first.descriptors, second.descriptors), options.orb_ratio)


def distances(first: Features, second: Features) -> Distances:
    """How far descriptors of one kind are apart (n, n'): squared Euclidean for RootSIFT, bits that differ for ORB."""
    measure = _squared_distances if first.kind == "rootsift" else _hamming_distances
    return measure(first.descriptors, second.descriptors)


def mutual(distances: Distances, ratio: float) -> Indices:
    """Pairs (k, 2) nearest to each other in `distances` (n, n'), below `ratio` times the second best of either.

    Of equals none stands out, so no keypoint is taken twice.
    """
    nearest = distances.argmin(axis=1)
    best = distances[np.arange(len(distances)), nearest]
    rows = np.flatnonzero(best <= distances.min(axis=0)[nearest])
    columns, best = nearest[rows], best[rows]
    in_row, in_column = distances[rows], distances[:, columns]
    in_row[np.arange(len(rows)), columns] = np.inf
    in_column[rows, np.arange(len(rows))] = np.inf
    rival = np.minimum(in_row.min(axis=1, initial=np.inf), in_column.min(axis=0, initial=np.inf))
    kept = best < ratio * rival
    return np.column_stack((rows[kept], columns[kept]))


def _squared_distances(first: Descriptors, second: Descriptors) -> Distances:
    """|a - b|^2 by one matrix product. Bytes make every sum an integer below 2^24: float32 is exact."""
    a, b = first.astype(np.float32), second.astype(np.float32)
    distances: Distances = a @ (-2 * b).T
    distances += np.einsum("ij,ij->i", a, a)[:, None]
    distances += np.einsum("ij,ij->i", b, b)
    return distances


def _hamming_distances(first: Descriptors, second: Descriptors) -> Distances:
    """Bits that differ, by one matrix product too: with bits as -1 and 1, a . b = bits - 2 |a - b|."""
    a, b = (2 * np.unpackbits(descriptors, axis=1).astype(np.float32) - 1 for descriptors in (first, second))
    distances: Distances = (a.shape[1] - a @ b.T) / 2
    return distances
