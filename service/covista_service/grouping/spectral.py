"""The best M groups of a similarity matrix: Ng, Jordan and Weiss, without a random number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.grouping.similarity import Floats

Labels = NDArray[np.intp]
# Up to this many robots every row starts a seeding; a larger swarm is seeded from evenly spread rows.
MAX_STARTS = 200
_STARTS_BEYOND = 32
# k-means runs from the best few seedings.
_FEW = 3
_ROUNDS = 30


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Eigenvectors (N, N) of D^-1/2 S D^-1/2 as columns, largest eigenvalue first: one serves every M."""

    vectors: Floats

    @classmethod
    def of(cls, S: Floats) -> Spectrum:
        """Decompose a symmetric similarity matrix (N, N) with s_ii = 1."""
        if S.ndim != 2 or S.shape[0] != S.shape[1] or not len(S):
            raise ValueError(f"a similarity matrix is square and not empty, not {S.shape}")
        scale = 1 / np.sqrt(S.sum(axis=1))
        vectors = np.linalg.eigh(scale[:, None] * S * scale)[1]
        return cls(np.ascontiguousarray(vectors[:, ::-1]))

    def rows(self, m: int) -> Floats:
        """Rows (N, m) of the m first eigenvectors, at unit length (a row of zeros stays)."""
        first = self.vectors[:, :m]
        length = np.linalg.norm(first, axis=1, keepdims=True)
        unit: Floats = first / np.where(length > 0, length, 1.0)
        return unit


def partition(spectrum: Spectrum, m: int) -> Labels:
    """Part N robots into exactly m groups; labels (N,) from 0, numbered as they first appear."""
    count = len(spectrum.vectors)
    if not 1 <= m <= count:
        raise ValueError(f"{count} robots cannot form {m} groups")
    if m == 1:
        return np.zeros(count, np.intp)
    if m == count:
        return np.arange(count)
    rows = spectrum.rows(m)
    return canonical(_k_means(rows, _best_seeds(rows, m)))


def canonical(labels: Labels) -> Labels:
    """The same groups, numbered in the order of their first robots."""
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.intp)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse]


def _starts(count: int) -> NDArray[np.intp]:
    if count <= MAX_STARTS:
        return np.arange(count)
    return np.linspace(0, count - 1, _STARTS_BEYOND).astype(np.intp)


def _best_seeds(rows: Floats, m: int) -> NDArray[np.intp]:
    """Orthogonal seedings of unit rows (N, m), the cheapest few (<= 3, m) of one from every start.

    From each start the next seed is the row whose largest |cosine| with the seeds so far is least. The cost of a
    seeding is the squared distance of all rows to their nearest seeds.
    """
    cosine = rows @ rows.T
    size = np.abs(cosine)
    last = _starts(len(rows))
    everyone = np.arange(len(last))
    seeds = np.empty((len(last), m), np.intp)
    seeds[:, 0] = last
    taken, nearest = size[last], cosine[last]
    room = np.empty_like(taken)
    for step in range(1, m):
        taken[everyone, last] = np.inf
        last = taken.argmin(axis=1)
        seeds[:, step] = last
        np.maximum(taken, size.take(last, axis=0, out=room, mode="clip"), out=taken)
        np.maximum(nearest, cosine.take(last, axis=0, out=room, mode="clip"), out=nearest)
    cost = -nearest.sum(axis=1)
    chosen: dict[tuple[int, ...], int] = {}
    for start in np.argsort(np.round(cost, 9), kind="stable"):
        chosen.setdefault(tuple(sorted(seeds[start].tolist())), int(start))
        if len(chosen) == _FEW:
            break
    return np.array(list(chosen), np.intp)


def _k_means(rows: Floats, seeds: NDArray[np.intp]) -> Labels:
    """Lloyd's rounds from rows `seeds` (runs, m), all runs at once: the cheapest labels, with no group empty."""
    m = seeds.shape[1]
    centres = rows[seeds]
    labels = np.full((len(seeds), len(rows)), -1, np.intp)
    for _ in range(_ROUNDS):
        # Less |row|^2, which is the same for all centres.
        distance = np.square(centres).sum(axis=2)[:, None, :] - 2 * rows @ centres.transpose(0, 2, 1)
        fresh = distance.argmin(axis=2)
        for run in range(len(seeds)):
            _occupy(fresh[run], distance[run], m)
        if np.array_equal(fresh, labels):
            break
        labels = fresh
        member = (labels[:, None, :] == np.arange(m)[:, None]).astype(np.float64)
        centres = (member @ rows) / member.sum(axis=2, keepdims=True)
    cost = [float(np.square(rows - centre[label]).sum()) for centre, label in zip(centres, labels, strict=True)]
    best: Labels = labels[int(np.argmin(np.round(cost, 12)))]
    return best


def _occupy(labels: Labels, distance: Floats, m: int) -> None:
    """Give every empty group the row that lies farthest from its own centre among those that can be spared."""
    sizes = np.bincount(labels, minlength=m)
    if sizes.all():
        return
    for empty in np.flatnonzero(sizes == 0):
        own = np.where(sizes[labels] > 1, distance[np.arange(len(labels)), labels], -np.inf)
        row = int(own.argmax())
        sizes[labels[row]] -= 1
        labels[row] = empty
        sizes[empty] = 1
