"""Matching along known epipolar lines: with the geometry settled, far more keypoints find their counterpart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Features, Floats


@dataclass(frozen=True, slots=True)
class GuidedOptions:
    """A candidate lies within `band_px` of the epipolar line and is likelier than the next by `ratio`.

    `least_cosine` between descriptors. For a pair that nothing else verifies, the matches must outnumber
    `chance_factor` times those that shuffled positions give, plus `chance_margin`.
    """

    band_px: float = 2.0
    ratio: float = 0.95
    least_cosine: float = 0.5
    chance_factor: float = 2.0
    chance_margin: int = 8


@dataclass(frozen=True, slots=True, eq=False)
class Directions:
    """Descriptors as unit vectors, of which cosines are taken: `values` (n, d) of RootSIFT, or signs in `bits` (n, w).

    The one or the other has no columns. A word of 64 bits is 64 components of one length, + or -.
    """

    values: NDArray[np.float32]
    bits: NDArray[np.uint64]

    @classmethod
    def of(cls, features: Features) -> Directions:
        """Those of RootSIFT or ORB."""
        count = len(features.descriptors)
        if features.kind == "orb":
            return cls(np.zeros((count, 0), np.float32), np.ascontiguousarray(features.descriptors).view(np.uint64))
        values = features.descriptors.astype(np.float32)
        length = np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1)
        return cls(np.asarray(values / length, np.float32), np.zeros((count, 0), np.uint64))


def guided_matches(
    first_px: Floats, first: Directions, second_px: Floats, second: Directions, F: Floats, options: GuidedOptions
) -> NDArray[np.int64]:
    """Index pairs (k, 2) of mutual best matches with v_2 . F v_1 = 0 to within the band; both of one kind."""
    if not len(first_px) or not len(second_px):
        return np.zeros((0, 2), np.int64)
    return np.asarray(
        _match(
            first_px,
            first.values,
            first.bits,
            second_px,
            second.values,
            second.bits,
            np.ascontiguousarray(F),
            options.band_px,
            options.ratio**2,
            options.least_cosine,
        ),
        np.int64,
    )


@compiled
def _match(
    first: Floats,
    one: NDArray[np.float32],
    one_bits: NDArray[np.uint64],
    second: Floats,
    other: NDArray[np.float32],
    other_bits: NDArray[np.uint64],
    F: Floats,
    band_px: float,
    ratio2: float,
    least: float,
) -> NDArray[np.int64]:
    """One pass over all pairs of points within the band: the best and the second best of either side."""
    best, top, runner_up = _nobody(len(first))
    best_back, top_back, runner_up_back = _nobody(len(second))
    for i in range(len(first)):
        x, y = first[i, 0], first[i, 1]
        a = F[0, 0] * x + F[0, 1] * y + F[0, 2]
        b = F[1, 0] * x + F[1, 1] * y + F[1, 2]
        c = F[2, 0] * x + F[2, 1] * y + F[2, 2]
        band = band_px * np.sqrt(a * a + b * b)
        for j in range(len(second)):
            if abs(a * second[j, 0] + b * second[j, 1] + c) < band:
                cosine = np.float32(0.0)
                for k in range(one.shape[1]):
                    cosine += one[i, k] * other[j, k]
                if one_bits.shape[1]:
                    cosine = _cosine_of_signs(one_bits[i], other_bits[j])
                _enter(i, j, cosine, best, top, runner_up)
                _enter(j, i, cosine, best_back, top_back, runner_up_back)
    # |d1 - d2|^2 = 2 - 2 cos for unit descriptors.
    stands_out = (top > least) & (1 - top < ratio2 * (1 - runner_up))
    stands_out_back = 1 - top_back < ratio2 * (1 - runner_up_back)
    pairs = np.empty((len(first), 2), np.int64)
    count = 0
    for i in range(len(first)):
        j = best[i]
        if j >= 0 and best_back[j] == i and stands_out[i] and stands_out_back[j]:
            pairs[count, 0], pairs[count, 1] = i, j
            count += 1
    return pairs[:count]


@compiled
def _cosine_of_signs(one: NDArray[np.uint64], other: NDArray[np.uint64]) -> np.float32:
    """1 - 2 (share of bits that differ), counted in parallel within each word."""
    differ = np.int64(0)
    for k in range(len(one)):
        word = one[k] ^ other[k]
        word -= (word >> np.uint64(1)) & np.uint64(0x5555555555555555)
        word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
        word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
        differ += np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))
    return np.float32(1 - differ / (32 * len(one)))


@compiled
def _nobody(count: int) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]:
    nothing = np.full(count, -1.0, np.float32)
    return np.full(count, -1, np.int64), nothing, nothing.copy()


@compiled
def _enter(
    i: int,
    j: int,
    cosine: np.float32,
    best: NDArray[np.int64],
    top: NDArray[np.float32],
    runner_up: NDArray[np.float32],
) -> None:
    if cosine > top[i]:
        runner_up[i], top[i], best[i] = top[i], cosine, j
    elif cosine > runner_up[i]:
        runner_up[i] = cosine
