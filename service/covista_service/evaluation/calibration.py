"""The constants behind intervals, fitted to answers of which the truth is known, and judged on sets left out."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from covista_service.evaluation.case import Pair
from covista_service.perception.camera import Floats
from covista_service.perception.certainty import TERMS, CertaintyOptions, terms
from covista_service.perception.scene import Scene

Mask = NDArray[np.bool_]
LEVEL = 0.9
# No weight goes to infinity where a clue is always 0. Shares are counted in columns of 1/48: times the reach, some two
# fifths of one are the least error.
_RIDGE = 1e-3
_LEAST_FLOOR = 4e-3


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """Answers to n ordered pairs with their truth.

    `kinds` (n,) names the kind of set; `down`, `up` (n, TERMS) are the terms of `certainty`; `matched`: the
    pair's images were; `noisy`: errors were put on its poses.
    """

    kinds: NDArray[np.str_]
    truth: Floats
    overlap: Floats
    down: Floats
    up: Floats
    matched: Mask
    noisy: Mask

    def __len__(self) -> int:
        return len(self.truth)

    def only(self, chosen: Mask) -> Trials:
        """Those where `chosen` (n,) is true."""
        return Trials(*(getattr(self, name)[chosen] for name in self.__slots__))

    @property
    def doubtful(self) -> Mask:
        """Does any clue say (n,) that the answer may be wrong? None does if the cameras look far past each other."""
        return np.asarray((self.down[:, 1:] + self.up[:, 1:]).any(axis=1), np.bool_)

    @property
    def telling(self) -> Mask:
        """Which trials (n,) constants are fitted to.

        Pairs beyond doubt would make others look surer than they are, and so would unmatched pairs with exact poses: in
        the field nobody has checked those.
        """
        return self.doubtful & (self.matched | self.noisy | (not self.noisy.any()))


def joined(trials: Sequence[Trials]) -> Trials:
    """All of them in one."""
    return Trials(*(np.concatenate([getattr(one, name) for one in trials]) for name in Trials.__slots__))


def kind(name: str) -> str:
    """What a set is one of: sets whose names differ in a number at the end alone are judged, and left out, together."""
    return re.sub(r"[_-]\d+$", "", name)


def tried(name: str, truth: Floats, pairs: Sequence[Pair], scene: Scene, *, noisy: bool) -> Trials:
    """What `scene` says of the pairs of a set whose `truth` (n, n) is defined."""
    rows = []
    for i, j in [ordered for a, b in pairs for ordered in ((a, b), (b, a))]:
        found = scene.found(i, j)
        if found is None or not np.isfinite(truth[i, j]):
            continue
        matched = bool(scene.matched.get((i, j)) or scene.matched.get((j, i)))
        down, up = terms(found.clues[None], np.array([not matched]))
        rows.append((truth[i, j], found.overlap, matched, down[0], up[0]))
    columns = list(zip(*rows, strict=True)) or [()] * 5
    downwards, upwards = (np.array(column, np.float64).reshape(-1, len(TERMS)) for column in columns[3:])
    return Trials(
        np.full(len(rows), kind(name)),
        np.array(columns[0], np.float64),
        np.array(columns[1], np.float64),
        downwards,
        upwards,
        np.array(columns[2], np.bool_),
        np.full(len(rows), noisy),
    )


def fit(trials: Trials) -> CertaintyOptions:
    """The constants that make the errors of `trials` most likely, and the reach that holds nine of ten."""
    weights = fitted(trials)
    return CertaintyOptions(
        **dict(zip(TERMS, weights.tolist(), strict=True)), nine_in_ten=reach(trials, weights, LEVEL)
    )


def reach(trials: Trials, weights: Floats, level: float) -> float:
    """How many usual errors the share `level` of the errors does not exceed: the conformal quantile."""
    scores = np.sort(_scores(trials.only(trials.telling), weights))
    rank = int(np.ceil((len(scores) + 1) * level))
    return float(scores[min(rank, len(scores)) - 1]) if len(scores) else 1.0


def intervals(trials: Trials, weights: Floats, reach: float) -> Floats:
    """Intervals (2, n) of the answers."""
    low, high = trials.overlap - reach * (trials.down @ weights), trials.overlap + reach * (trials.up @ weights)
    return np.stack((np.maximum(low, 0.0), np.minimum(high, 1.0)))


def left_out(trials: Trials, levels: Sequence[float] = (LEVEL,)) -> Floats:
    """Intervals (levels, 2, n) of each kind of set, by constants fitted to all others."""
    found = np.full((len(levels), 2, len(trials)), np.nan)
    for name in np.unique(trials.kinds):
        here = trials.kinds == name
        others = trials.only(~here)
        weights = fitted(others)
        for k, level in enumerate(levels):
            found[k][:, here] = intervals(trials.only(here), weights, reach(others, weights, level))
    return found


def fitted(trials: Trials) -> Floats:
    """Weights (TERMS,), none negative: the most likely under Laplace's density with a scale for either side.

    p(e) = exp(-e / up) / (up + down) for errors e > 0, with -e / down for the others. A kind of set counts with the
    root of its number of answers, so that a large one does not decide alone and a tiny one not at all.
    """
    trials = trials.only(trials.telling)
    error = trials.truth - trials.overlap
    above, below = np.maximum(error, 0.0), np.maximum(-error, 0.0)
    _, which, counts = np.unique(trials.kinds, return_inverse=True, return_counts=True)
    share = counts[which] ** -0.5
    share /= max(float(share.sum()), 1.0)

    def cost(weights: Floats) -> tuple[float, Floats]:
        down, up = trials.down @ weights, trials.up @ weights
        value = share @ (np.log(down + up) + above / up + below / down) + _RIDGE * weights @ weights
        both = 1 / (down + up)
        slope = trials.down.T @ (share * (both - below / down**2)) + trials.up.T @ (share * (both - above / up**2))
        return float(value), slope + 2 * _RIDGE * weights

    limits = [(_LEAST_FLOOR, None)] + [(0.0, None)] * (len(TERMS) - 1)
    start = np.full(len(TERMS), 0.05)
    return np.asarray(minimize(cost, start, jac=True, bounds=limits, method="L-BFGS-B").x, np.float64)


def _scores(trials: Trials, weights: Floats) -> Floats:
    """Errors (n,) in usual errors of their side."""
    error = trials.truth - trials.overlap
    usual = np.where(error > 0, trials.up @ weights, trials.down @ weights)
    return np.asarray(np.abs(error) / usual, np.float64)
