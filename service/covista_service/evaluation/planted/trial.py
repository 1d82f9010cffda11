"""One grouping of one swarm by one method, and what it is worth; the figures of many."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from covista_service.evaluation.planted.swarm import CLASSES, STORIES

ABOVE = 30
_UNUSUAL = ("one", "apart")


@dataclass(frozen=True, slots=True)
class Trial:
    """`variant` is how the overlaps were disturbed, `ari` the adjusted Rand index, `ms` the time to group."""

    variant: str
    method: str
    kind: str
    seed: int
    robots: int
    groups: int
    true_groups: int
    ari: float
    ms: float


@dataclass(frozen=True, slots=True)
class Figures:
    """What a method is worth over the swarms of a variant; None where there was none of the sort.

    Mean ARI of all, of classes of size and of more than 30 robots (swarms that are one group, or none, count in the
    whole alone), and of kinds; `tenth`: its 10th percentile; shares of swarms kept as one group, and kept apart.
    """

    variant: str
    method: str
    swarms: int
    ari: float
    tenth: float
    by_size: dict[str, float | None]
    above_30: float | None
    by_kind: dict[str, float | None]
    kept_one: float | None
    kept_apart: float | None
    ms_median: float

    def as_json(self) -> dict[str, object]:
        """The figures as they stand in planted.json."""
        return asdict(self)


def size_classes(largest: int) -> dict[str, tuple[int, int]]:
    """Classes of size by name; one more where swarms are larger than usual."""
    bounds = list(CLASSES)
    if largest > bounds[-1][1]:
        bounds.append((bounds[-1][1] + 1, largest))
    return {f"{least}-{most}": (least, most) for least, most in bounds}


def figures(trials: Sequence[Trial], largest: int) -> list[Figures]:
    """Figures of every method and variant, in the order in which they come."""
    pairs = dict.fromkeys((trial.variant, trial.method) for trial in trials)
    return [_figures([trial for trial in trials if (trial.variant, trial.method) == pair], largest) for pair in pairs]


def _figures(trials: Sequence[Trial], largest: int) -> Figures:
    def mean(wanted: Callable[[Trial], bool]) -> float | None:
        values = [trial.ari for trial in trials if wanted(trial)]
        return float(np.mean(values)) if values else None

    def within(least: int, most: int) -> float | None:
        return mean(lambda trial: trial.kind not in _UNUSUAL and least <= trial.robots <= most)

    def kept(kind: str) -> float | None:
        values = [trial.groups == trial.true_groups for trial in trials if trial.kind == kind]
        return float(np.mean(values)) if values else None

    def of_kind(kind: str) -> float | None:
        return mean(lambda trial: trial.kind == kind)

    every = [trial.ari for trial in trials]
    kinds = [kind for kind in dict.fromkeys((*STORIES, *(t.kind for t in trials))) if kind not in _UNUSUAL]
    return Figures(
        trials[0].variant,
        trials[0].method,
        len(trials),
        float(np.mean(every)),
        float(np.quantile(every, 0.1)),
        {name: within(*bounds) for name, bounds in size_classes(largest).items()},
        within(ABOVE + 1, largest),
        {kind: of_kind(kind) for kind in kinds},
        kept("one"),
        kept("apart"),
        float(np.median([trial.ms for trial in trials])),
    )
