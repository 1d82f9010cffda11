"""The paper's claim: counting features detects that two images overlap, but does not measure by how much.

Every measure is asked about many pairs of rendered views, and correlated with the true overlap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from covista_clients.simulation import truth, worlds
from covista_clients.simulation.renderer import render
from covista_clients.simulation.viewing import pinhole
from scipy import stats

from covista_service.drawing import plots
from covista_service.evaluation.case import Answer, Case, Pair
from covista_service.evaluation.methods import METHODS
from covista_service.evaluation.paper.chapter import Chapter, Item, Tell
from covista_service.evaluation.rendered import case_of, view_of
from covista_service.perception.camera import Floats

NAME = "Correlation with the true overlap"
WORLDS: tuple[tuple[str, int], ...] = tuple((name, seed) for seed in (0, 1) for name in worlds.WORLDS)
MEASURES: tuple[str, ...] = ("snavely", "bruckner", "coslam", "hull", "distance", "frustum", "planes", "auto")
# What the paper compares planes with: measures that count or compare features, and distance.
RIVALS: tuple[str, ...] = ("snavely", "bruckner", "coslam", "hull", "distance")
CAMERA = pinhole(320, 240)
_VIEWS = 6
_SURFACES_CLEAR = 0.03
# True overlap from which on a pair counts as overlapping.
_OVERLAPS = 0.1


@dataclass(frozen=True, slots=True)
class Correlation:
    """Pearson's and Spearman's, 0 where a measure says the same of every pair."""

    pearson: float
    spearman: float


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Pairs of one kind: their true overlaps (n,), and what each measure says of them (n,)."""

    kind: str
    true: Floats
    given: Mapping[str, Floats]

    @property
    def correlations(self) -> dict[str, Correlation]:
        """Of every measure."""
        return {name: _correlated(self.true, values) for name, values in self.given.items()}


def correlation(tell: Tell, chosen: Sequence[tuple[str, int]] = WORLDS) -> Chapter:
    """The chapter, over views of the worlds (name, seed) chosen; measures that are not at hand are left out."""
    names = [name for name in MEASURES if name in METHODS]
    true: list[float] = []
    said: dict[str, list[float]] = {name: [] for name in names}
    for world, seed in chosen:
        tell(f"{NAME}: {world}, seed {seed}")
        overlaps, case = _pairs(world, seed)
        true += overlaps.values()
        for name in names:
            answers = METHODS[name](case)
            said[name] += [_similarity(answers[pair]) for pair in overlaps]
    known = np.array(true)
    given = {name: np.array(values) for name, values in said.items()}
    overlapping = known >= _OVERLAPS
    every = Sample("all pairs", known, given)
    sharing = Sample(
        f"overlap >= {_OVERLAPS:g}",
        known[overlapping],
        {name: values[overlapping] for name, values in given.items()},
    )
    drawn = {"correlation.png": _plot(every), "correlation_table.png": _table((every, sharing))}
    return Chapter(tuple(item for sample in (every, sharing) for item in _items(sample)), drawn)


def _pairs(name: str, seed: int) -> tuple[dict[Pair, float], Case]:
    """Mean true overlap of both directions (Eq. 16) by pair of views, and the case."""
    world = worlds.build(name, seed)
    poses = worlds.viewpoints(world, _VIEWS, seed)
    views = [view_of(CAMERA, pose, render(world, CAMERA, pose).image) for pose in poses]
    overlaps = {
        (a, b): sum(truth.overlap(world, CAMERA, poses[i], CAMERA, poses[j]) for i, j in ((a, b), (b, a))) / 2
        for a, b in combinations(range(_VIEWS), 2)
    }
    return overlaps, case_of(views, tuple(overlaps))


def _similarity(answer: Answer) -> float:
    """(q_i + q_j)/2 of Eq. 16; no answer is 0."""
    return ((answer.overlap_a or 0.0) + (answer.overlap_b or 0.0)) / 2


def _correlated(true: Floats, given: Floats) -> Correlation:
    if np.ptp(true) == 0 or np.ptp(given) == 0:
        return Correlation(0.0, 0.0)
    return Correlation(float(stats.pearsonr(true, given).statistic), float(stats.spearmanr(true, given).statistic))


def _items(sample: Sample) -> list[Item]:
    found = sample.correlations
    items = []
    for kind in ("pearson", "spearman"):
        r = {name: round(float(getattr(each, kind)), 3) for name, each in found.items()}
        what, planes = f"{kind.capitalize()}, {sample.kind}", r["planes"]
        items += [
            Item(NAME, f"{what}: {name} below planes ({planes:.3f})", None, r[name], r[name] < planes)
            for name in RIVALS
            if name in r
        ]
        best = max(r.values())
        law = f"{what}: auto not below any other by more than {_SURFACES_CLEAR:g} (best {best:.3f})"
        items.append(Item(NAME, law, None, r["auto"], r["auto"] >= best - _SURFACES_CLEAR))
    return items


def _plot(sample: Sample) -> bytes:
    found = sample.correlations
    panels = [
        plots.Panel(f"{name}: r = {found[name].pearson:.3f}, rank {found[name].spearman:.3f}", sample.true, values)
        for name, values in sample.given.items()
    ]
    title = f"Measures of {len(sample.true)} pairs of rendered views against their true overlap"
    return plots.scatters(panels, title, "true overlap, mean of both directions", "as measured")


def _table(samples: Sequence[Sample]) -> bytes:
    found = [sample.correlations for sample in samples]
    rows = [
        (name, *(f"{r:.3f}" for each in found for r in (each[name].pearson, each[name].spearman))) for name in found[0]
    ]
    heads = [
        f"{coefficient},\n{sample.kind} ({len(sample.true)})"
        for sample in samples
        for coefficient in ("Pearson", "Spearman")
    ]
    return plots.table(NAME, ("measure", *heads), rows)
