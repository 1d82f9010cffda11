"""The best M groups of a similarity matrix: Ng, Jordan and Weiss, without a random number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from covista_service.grouping.k_means import Labels, k_means
from covista_service.grouping.similarity import Floats

# Up to this many robots every row starts a seeding; a larger swarm is seeded from that many rows.
MAX_STARTS = 48
# From this many robots on, a few eigenvectors are cheaper than all, if they are fewer than a certain share. Lanczos
# would be cheaper still, but finds one vector of the many that groups with nothing in common share an eigenvalue with.
PARTIAL_FROM = 100
PARTIAL_SHARE = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Eigenvectors of D^-1/2 S D^-1/2 as columns (N, k), the largest eigenvalues (k,) first: one serves every M <= k.

    `degree` (N,): how much each robot has in common with all.
    """

    vectors: Floats
    values: Floats
    degree: Floats

    @classmethod
    def of(cls, S: Floats, most: int | None = None) -> Spectrum:
        """Decompose a symmetric similarity matrix (N, N) with s_ii = 1, as far as `most` groups need; None: wholly."""
        if S.ndim != 2 or S.shape[0] != S.shape[1] or not len(S):
            raise ValueError(f"a similarity matrix is square and not empty, not {S.shape}")
        degree = S.sum(axis=1)
        scale = 1 / np.sqrt(degree)
        normalised = scale[:, None] * S * scale
        count = len(S)
        subset = None
        if most is not None and count >= PARTIAL_FROM and most <= PARTIAL_SHARE * count:
            subset = (count - most, count - 1)
        values, vectors = eigh(normalised, subset_by_index=subset, overwrite_a=True, check_finite=False)
        return cls(np.ascontiguousarray(vectors[:, ::-1]), values[::-1], degree)

    @property
    def most(self) -> int:
        """Up to how many groups it serves."""
        return int(self.vectors.shape[1])

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
    if m > spectrum.most and m < count:
        raise ValueError(f"these eigenvectors serve up to {spectrum.most} groups, not {m}")
    if m == 1:
        return np.zeros(count, np.intp)
    if m == count:
        return np.arange(count)
    return k_means(spectrum.rows(m), m, _starts(spectrum.degree))


def _starts(degree: Floats) -> NDArray[np.intp]:
    """All rows, or some that are evenly spread over how much robots have in common: the same ones in any order."""
    if len(degree) <= MAX_STARTS:
        return np.arange(len(degree))
    spread = np.linspace(0, len(degree) - 1, MAX_STARTS).astype(np.intp)
    return np.argsort(degree, kind="stable")[spread]
