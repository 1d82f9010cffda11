"""How sure an overlap is: an interval that holds the true q in nine cases of ten, from where two surfaces disagree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Floats
from covista_service.perception.visibility import SAME_SCALE, Gallery, Seeing, VisibilityOptions, looks

Interval = tuple[float, float]
Mask = NDArray[np.bool_]
TERMS = ("floor", "apart", "before", "hidden", "edge")


@dataclass(frozen=True, slots=True)
class CertaintyOptions:
    """What each clue adds to the usual error of q, and by how many usual errors `nine_in_ten` are not exceeded.

    Downwards q errs by floor + apart + before, upwards by floor + apart + hidden. Between images that do not match,
    where nothing but reported poses says what lies within the other image, also by what is near its `edge`, inside or
    outside. Fitted by `covista-station calibrate`.
    """

    floor: float = 0.004
    apart: float = 1.69
    before: float = 1.31
    hidden: float = 0.284
    edge: float = 0.36
    nine_in_ten: float = 1.87

    @property
    def weights(self) -> tuple[float, ...]:
        """The weights of `TERMS`, in their order."""
        return self.floor, self.apart, self.before, self.hidden, self.edge


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What a camera sees of an image: its share q, the 90 % interval of that, and the clues (5,) behind it."""

    overlap: float
    interval: Interval
    clues: Floats


def find(
    first: Seeing,
    second: Seeing,
    rotation: Floats,
    translation: Floats,
    visibility: VisibilityOptions,
    options: CertaintyOptions,
    *,
    matched: bool,
    ratios: tuple[float, float] = SAME_SCALE,
) -> Found:
    """What the second camera sees of the first one's image and how sure that is, for X_2 = R X_1 + t.

    `matched`: the images of this very pair were matched; `ratios` as for `visibility.seen`.
    """
    pair, scales = np.array([[0, 1]]), np.array([ratios])
    said = looks(Gallery.of((first, second)), pair, rotation[None], translation[None], scales, visibility)
    low, high = intervals(said.shares, said.clues, np.array([matched]), options)[0].tolist()
    return Found(float(said.shares[0]), (low, high), said.clues[0])


def intervals(overlaps: Floats, clues: Floats, matched: Mask, options: CertaintyOptions) -> Floats:
    """The 90 % intervals (n, 2) of overlaps q (n,) by their clues (n, 5): within [0, 1], and q within its own."""
    weights = np.array(options.weights)
    down, up = terms(clues, ~matched)
    low = overlaps - options.nine_in_ten * (down @ weights)
    high = overlaps + options.nine_in_ten * (up @ weights)
    return np.column_stack((np.maximum(low, 0.0), np.minimum(high, 1.0)))


def terms(clues: Floats, unmatched: Mask) -> tuple[Floats, Floats]:
    """What the weights multiply, downwards and upwards (n, TERMS)."""
    apart, before, hidden, inner_edge, outer_edge = clues.T
    one, none = np.ones(len(clues)), np.zeros(len(clues))
    down = np.column_stack((one, apart, before, none, inner_edge * unmatched))
    up = np.column_stack((one, apart, none, hidden, outer_edge * unmatched))
    return down, up
