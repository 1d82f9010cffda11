"""Fig. 7: what groups have in common, and how close their cameras are, as alpha goes from 0 to 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from covista_service.drawing import plots
from covista_service.evaluation.paper import grouped
from covista_service.evaluation.paper.chapter import Chapter, Item, Tell
from covista_service.evaluation.paper.group_tables import TABLE_2, TABLE_3
from covista_service.evaluation.paper.layouts import Scenario, scattered, seen
from covista_service.perception.camera import Floats

NAME = "Fig. 7"
ALPHAS: tuple[float, ...] = tuple(k / 100 for k in range(101))
# "Extremely small": at most this share of what is in common inside the groups at alpha = 1.
SMALL = 1 / 3
# Cameras and groups as in the paper's curve. It says that the same holds for other numbers of groups.
PRINTED = (10, 2)
SWARMS: tuple[tuple[int, int], ...] = (PRINTED, (5, 2), (20, 2), (10, 3), (10, 4))
_ROUNDING = 1e-9
_TOP = 0.6


@dataclass(frozen=True, slots=True, eq=False)
class TradeOff:
    """Means over the groups of (q_i + q_j)/2 and of d_ij of their pairs, (k,) each, over `alpha` (k,)."""

    cameras: int
    groups: int
    alpha: Floats
    overlap: Floats
    closeness: Floats

    @property
    def title(self) -> str:
        """What is parted into how many."""
        return f"N = {self.cameras}, M = {self.groups}"


def trade_off(tell: Tell, swarms: Sequence[tuple[int, int]] = SWARMS, alphas: Sequence[float] = ALPHAS) -> Chapter:
    """The chapter, over swarms (number of cameras, number of groups)."""
    found = []
    for count, groups in swarms:
        tell(f"{NAME}: {count} cameras in {groups} groups")
        found.append(measure(_cameras(count), groups, alphas))
    items = [item for each in found for item in _ends(each)]
    items += [item for each in found if (each.cameras, each.groups) == PRINTED for item in _shape(each)]
    two = [each for each in found if each.groups == PRINTED[1]]
    more = [each for each in found if each.groups != PRINTED[1]]
    drawn = {"fig_7.png": _plot(two, "two groups")}
    if more:
        drawn["fig_7_more_groups.png"] = _plot(more, "more groups")
    return Chapter(tuple(items), drawn)


def measure(cameras: Scenario, groups: int, alphas: Sequence[float]) -> TradeOff:
    """Part the cameras at every alpha, and measure what the groups come to."""
    known, way = seen(cameras), grouped.into(groups)
    labels = [grouped.labels(known, alpha, way) for alpha in alphas]
    overlap, closeness = (
        np.array([grouped.within(values, found) for found in labels]) for values in (known.mutual, known.closeness)
    )
    return TradeOff(len(cameras.vantages), groups, np.array(alphas), overlap, closeness)


def _cameras(count: int) -> Scenario:
    """Scenarios 1 and 2, and other numbers anywhere in the same hall."""
    known = {len(table.scenario.vantages): table.scenario for table in (TABLE_2, TABLE_3)}
    return known[count] if count in known else scattered(f"{count} cameras", count, 0)


def _ends(each: TradeOff) -> list[Item]:
    overlap, near = each.overlap[[0, -1]].tolist(), each.closeness[[0, -1]].tolist()
    more = "overlap inside the groups is larger at alpha = 1 than at 0"
    farther = "closeness d inside the groups is smaller at alpha = 1 than at 0"
    return [
        Item(NAME, f"{each.title}: mean {more}", None, _from_to(*overlap), overlap[1] > overlap[0]),
        Item(NAME, f"{each.title}: mean {farther}", None, _from_to(*near), near[1] < near[0]),
    ]


def _shape(each: TradeOff) -> list[Item]:
    falls, rises = float(-np.diff(each.overlap).min()), float(np.diff(each.closeness).max())
    ratio = float(each.overlap[0] / each.overlap[-1])
    middle = len(each.alpha) // 2
    between = all(min(y[0], y[-1]) < y[middle] < max(y[0], y[-1]) for y in (each.overlap, each.closeness))
    return [
        Item(
            NAME,
            f"{each.title}: at alpha = 0 the mean overlap is at most {SMALL:.2f} of that at 1",
            "extremely small",
            f"{each.overlap[0]:.3f}, {ratio:.2f} of it",
            ratio <= SMALL,
        ),
        Item(
            NAME,
            f"{each.title}: at alpha = {each.alpha[middle]:g} both means lie between those at 0 and at 1",
            "a good trade-off",
            f"overlap {each.overlap[middle]:.3f}, d {each.closeness[middle]:.3f}",
            between,
        ),
        Item(NAME, f"{each.title}: mean overlap never falls as alpha grows", None, _steps(falls), falls <= _ROUNDING),
        Item(NAME, f"{each.title}: mean d never rises as alpha grows", None, _steps(rises), rises <= _ROUNDING),
    ]


def _from_to(start: float, end: float) -> str:
    return f"{start:.3f} to {end:.3f}"


def _steps(worst: float) -> str:
    return "never" if worst <= _ROUNDING else f"by {worst:.3f}"


def _plot(found: Sequence[TradeOff], title: str) -> bytes:
    panels = {
        each.title: [
            plots.Curve("mean overlap (q_i + q_j)/2 inside the groups", each.alpha, each.overlap),
            plots.Curve("mean closeness d_ij inside the groups", each.alpha, each.closeness),
        ]
        for each in sorted(found, key=lambda each: each.cameras)
    }
    return plots.curves(
        panels, f"{NAME}: means inside the groups over alpha, {title}", "alpha", "mean over groups", "linear", _TOP
    )
