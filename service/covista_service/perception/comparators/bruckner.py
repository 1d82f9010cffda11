"""How clearly the features of two images correspond: the entropy of who matches whom, or an excess of geometry.

After Brückner, Bajramovic, Denzler, "Geometric and Probabilistic Image Dissimilarity Measures for Common Field of View
Detection", CVPR 2009. Reconstructed from memory of the literature, not from the article: the form and the constants may
differ from the authors'. Neither says how large the common part is, only that there is one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from covista_service.compiled import compiled
from covista_service.perception.camera import Features, Floats
from covista_service.perception.comparators.consensus import ConsensusOptions, consensus
from covista_service.perception.comparators.image import Image
from covista_service.perception.matching import MatchingOptions, distances, match

# Descriptors are bytes, so that none but equal ones are nearer to each other.
_EQUAL = 1e-6
# exp(-50) is nothing beside 1, and what is nearest weighs 1.
_NEVER = 50.0


@dataclass(frozen=True, slots=True)
class EntropyOptions:
    """`scale` lambda: what share of the nearest distance a rival may be further off and still be one."""

    scale: float = 0.5


@dataclass(frozen=True, slots=True)
class GeometricOptions:
    """Mutual nearest neighbours without a ratio; chance is the mean over `draws` permutations of them."""

    matching: MatchingOptions = field(default_factory=lambda: MatchingOptions(1.0, 1.0))
    consensus: ConsensusOptions = field(default_factory=ConsensusOptions)
    draws: int = 3


ENTROPY = EntropyOptions()
GEOMETRIC = GeometricOptions()


def entropy_similarity(first: Features, second: Features, options: EntropyOptions = ENTROPY) -> float:
    """(1 - H) / (1 - H_min), from 0 (any feature may match any other) to 1 (each has one match).

    H = (log n + mean_i H_i) / (log n + log n') is the normalised joint entropy of p(i) p(j|i), with p(i) = 1/n and
    p(j|i) ~ exp(-(d_ij - d_N(i)) / (lambda d_N(i))), d_N(i) the nearest distance, averaged over both directions;
    H_min is H where all H_i are 0. 0 for fewer than two features in an image, or different kinds.
    """
    n, other = len(first.descriptors), len(second.descriptors)
    if first.kind != second.kind or min(n, other) < 2:
        return 0.0
    apart = distances(first, second).astype(np.float64)
    if first.kind == "rootsift":
        apart = np.sqrt(apart)
    entropies = [float(np.mean(each)) for each in _conditionals(apart, *_falls(apart, options.scale))]
    joint = np.log(n) + np.log(other)
    marginals = np.log([n, other])
    least = float(np.mean(marginals / joint))
    found = float(np.mean((marginals + entropies) / joint))
    return float(np.clip((1 - found) / (1 - least), 0.0, 1.0))


def geometric_similarity(first: Image, second: Image, options: GeometricOptions = GEOMETRIC) -> float:
    """Share of the mutual nearest neighbours that epipolar geometry explains beyond chance, from 0 to 1."""
    if first.features.kind != second.features.kind:
        return 0.0
    matches = match(first.features, second.features, options.matching)
    one = first.features.keypoints_px[matches[:, 0]].astype(np.float64)
    other = second.features.keypoints_px[matches[:, 1]].astype(np.float64)
    side_px = max(first.larger_side_px, second.larger_side_px)
    found = int(consensus(one, other, side_px, options.consensus).sum())
    if not found:
        return 0.0
    random = np.random.default_rng(options.consensus.seed)
    draws = (consensus(one, random.permutation(other), side_px, options.consensus) for _ in range(options.draws))
    chance = float(np.mean([draw.sum() for draw in draws]))
    return max(0.0, (found - chance) / (len(matches) - chance)) if chance < len(matches) else 0.0


def _falls(apart: Floats, scale: float) -> tuple[Floats, Floats]:
    """1 / (lambda d_N) of each row (n,) and each column (n',)."""
    rows, columns = (1 / np.maximum(scale * apart.min(axis=axis), _EQUAL) for axis in (1, 0))
    return rows, columns


@compiled
def _conditionals(apart: Floats, row_falls: Floats, column_falls: Floats) -> tuple[Floats, Floats]:
    """Entropies H_i (n,) of p(j|i) along rows of distances (n, n'), and (n',) of p(i|j) along columns.

    With p = w / sum w and w = exp(-x), H = log sum w + sum (w x) / sum w: one exponential for each, and no logarithm.
    """
    n, m = apart.shape
    in_rows, nearest, sums, moments = np.zeros(n), np.full(m, np.inf), np.zeros(m), np.zeros(m)
    for i in range(n):
        for j in range(m):
            nearest[j] = min(nearest[j], apart[i, j])
    for i in range(n):
        total, moment, closest = 0.0, 0.0, apart[i].min()
        for j in range(m):
            x = (apart[i, j] - closest) * row_falls[i]
            if x < _NEVER:
                weight = math.exp(-x)
                total += weight
                moment += weight * x
            x = (apart[i, j] - nearest[j]) * column_falls[j]
            if x < _NEVER:
                weight = math.exp(-x)
                sums[j] += weight
                moments[j] += weight * x
        in_rows[i] = math.log(total) + moment / total
    return in_rows, np.log(sums) + moments / sums
