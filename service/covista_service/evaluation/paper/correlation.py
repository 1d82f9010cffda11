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
from covista_service.evaluation.case import Answer, Case, Pair, surveyed
from covista_service.evaluation.methods import METHODS
from covista_service.evaluation.paper.chapter import Chapter, Item, Tell
from covista_service.evaluation.rendered import view_of
from covista_service.perception.camera import Floats
from covista_service.perception.survey import SurveyOptions

NAME = "Correlation with the true overlap"
WORLDS: tuple[tuple[str, int], ...] = tuple((name, seed) for seed in (0, 1) for name in worlds.WORLDS)
MEASURES: tuple[str, ...] = ("snavely", "bruckner", "coslam", "hull", "distance", "frustum", "planes", "auto")
# What the paper compares planes with: measures that count or compare features, and distance.
RIVALS: tuple[str, ...] = ("snavely", "bruckner", "coslam", "hull", "distance")
CAMERA = pinhole(320, 240)
_VIEWS = 6
_SURFACES_CLEAR = 0.03


@dataclass(frozen=True, slots=True)
class Correlation:
    """Pearson's and Spearman's, 0 where a measure says the same of every pair."""

    pearson: float
    spearman: float


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
    found = {name: _correlated(known, values) for name, values in given.items()}
    drawn = {"correlation.png": _plot(known, given, found), "correlation_table.png": _table(found, len(known))}
    return Chapter(tuple(_items(found)), drawn)


def _pairs(name: str, seed: int) -> tuple[dict[Pair, float], Case]:
    """Mean true overlap of both directions (Eq. 16) by pair of views, and the case."""
    world = worlds.build(name, seed)
    poses = worlds.viewpoints(world, _VIEWS, seed)
    views = tuple(view_of(CAMERA, pose, render(world, CAMERA, pose).image) for pose in poses)
    overlaps = {
        (a, b): sum(truth.overlap(world, CAMERA, poses[i], CAMERA, poses[j]) for i, j in ((a, b), (b, a))) / 2
        for a, b in combinations(range(_VIEWS), 2)
    }
    return overlaps, surveyed(tuple(overlaps), views, SurveyOptions())


def _similarity(answer: Answer) -> float:
    """(q_i + q_j)/2 of Eq. 16; no answer is 0."""
    return ((answer.overlap_a or 0.0) + (answer.overlap_b or 0.0)) / 2


def _correlated(true: Floats, given: Floats) -> Correlation:
    if np.ptp(true) == 0 or np.ptp(given) == 0:
        return Correlation(0.0, 0.0)
    return Correlation(float(stats.pearsonr(true, given).statistic), float(stats.spearmanr(true, given).statistic))


def _items(found: Mapping[str, Correlation]) -> list[Item]:
    items = []
    for kind in ("pearson", "spearman"):
        r = {name: round(float(getattr(each, kind)), 3) for name, each in found.items()}
        title, planes = kind.capitalize(), r["planes"]
        items += [
            Item(NAME, f"{title}: {name} below planes ({planes:.3f})", None, r[name], r[name] < planes)
            for name in RIVALS
            if name in r
        ]
        best = max(r.values())
        law = f"{title}: auto not below any other by more than {_SURFACES_CLEAR:g} (best {best:.3f})"
        items.append(Item(NAME, law, None, r["auto"], r["auto"] >= best - _SURFACES_CLEAR))
    return items


def _plot(true: Floats, given: Mapping[str, Floats], found: Mapping[str, Correlation]) -> bytes:
    panels = [
        plots.Panel(f"{name}: r = {found[name].pearson:.2f}, rank {found[name].spearman:.2f}", true, values)
        for name, values in given.items()
    ]
    title = f"Measures of {len(true)} pairs of rendered views against their true overlap"
    return plots.scatters(panels, title, "true overlap, mean of both directions", "as measured")


def _table(found: Mapping[str, Correlation], pairs: int) -> bytes:
    rows = [(name, f"{each.pearson:.3f}", f"{each.spearman:.3f}") for name, each in found.items()]
    return plots.table(f"{NAME}, {pairs} pairs", ("measure", "Pearson's r", "Spearman's"), rows)
