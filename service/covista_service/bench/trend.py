"""Does something grow? A line through what was seen over time, how sure it is, and what else explains."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import stats

# Of what was seen, while things settle.
LEFT_OUT = 0.2
BLOCKS = 8
_CONFIDENCE = 0.95

Series = Sequence[tuple[float, float]]
Verdict = Literal["flat", "grows", "cannot say"]


@dataclass(frozen=True, slots=True)
class Trend:
    """Growth an hour and the half width of its 95 % interval, over so many hours, from a `level` on."""

    slope: float
    margin: float
    hours: float
    level: float

    @property
    def grown(self) -> float:
        """In all."""
        return self.slope * self.hours

    @property
    def unsure(self) -> float:
        """By so much it may have grown more, or less."""
        return self.margin * self.hours

    def verdict(self, bound: float) -> Verdict:
        """Flat is what has grown by no more than `bound`, in all, for sure: not what merely may have."""
        if self.grown + self.unsure <= bound:
            return "flat"
        return "grows" if self.grown - self.unsure > bound else "cannot say"


def trend_of(looks: Series, beside: Sequence[float] | None = None, blocks: int = BLOCKS) -> Trend:
    """The trend over the last 80 % of looks (seconds, value), four of them or more.

    A line through the means of blocks: what was just taken is not given back at once, so that looks of one moment say
    the same, and a line through them all would seem more certain than it is. `beside` is what else was there at each
    look and may explain the value in proportion; the trend is of what it does not explain.
    """
    left_out = round(LEFT_OUT * len(looks))
    others = [()] * len(looks) if beside is None else [(value,) for value in beside]
    kept = np.array([(*look, *other) for look, other in zip(looks, others, strict=True)][left_out:])
    means = np.array([block.mean(axis=0) for block in np.array_split(kept, min(blocks, len(kept)))])
    hours = (means[:, 0] - means[:, 0].mean()) / 3600
    explained = [column - column.mean() for column in means[:, 2:].T if np.ptp(column) > 0]
    design = np.column_stack((np.ones_like(hours), hours, *explained))
    middle, values = means[:, 1].mean(), means[:, 1] - means[:, 1].mean()
    slope = np.linalg.lstsq(design, values)[0][1]
    begin_h = (kept[0, 0] - means[:, 0].mean()) / 3600
    span_h = float(np.ptp(kept[:, 0])) / 3600
    return Trend(float(slope), _margin(design, values), span_h, float(middle + slope * begin_h))


def _margin(design: npt.NDArray[np.float64], values: npt.NDArray[np.float64]) -> float:
    """Half the width of the interval of the second coefficient; infinite where nothing is left to tell it from."""
    free = len(values) - np.linalg.matrix_rank(design)
    if free < 1 or np.linalg.matrix_rank(design) < design.shape[1]:
        return float("inf")
    rest = values - design @ np.linalg.lstsq(design, values)[0]
    variance = float(rest @ rest) / free * float(np.linalg.inv(design.T @ design)[1, 1])
    return float(stats.t.ppf((1 + _CONFIDENCE) / 2, free)) * math.sqrt(variance)
