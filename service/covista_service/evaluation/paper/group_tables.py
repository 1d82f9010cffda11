"""Tables II and III: two groups, and how they change with alpha. Figs. 5 and 6: where the cameras stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from covista_service.drawing import plots
from covista_service.drawing.scenario import from_above, perspective
from covista_service.evaluation.paper import grouped
from covista_service.evaluation.paper.chapter import Chapter, Item, Tell
from covista_service.evaluation.paper.grouped import TWO, Groups
from covista_service.evaluation.paper.layouts import HALL_M, SCENARIO_1, SCENARIO_2, Scenario, hall, seen
from covista_service.evaluation.paper.stages import stage

# How near a printed alpha may be to one at which the groups change.
LEAST_MARGIN = 0.04


@dataclass(frozen=True, slots=True)
class PrintedGroups:
    """A row of a table: alphas, in tenths from the first to the last, and the groups."""

    tenths: tuple[int, int]
    groups: Groups

    @property
    def alphas(self) -> tuple[float, ...]:
        """The alphas that the row speaks of."""
        return tuple(k / 10 for k in range(self.tenths[0], self.tenths[1] + 1))

    @property
    def interval(self) -> str:
        """The alphas as the paper puts them."""
        first, last = self.alphas[0], self.alphas[-1]
        return f"alpha = {first:g}" if first == last else f"{first:g} <= alpha <= {last:g}"


@dataclass(frozen=True, slots=True, eq=False)
class PrintedTable:
    """A table, the cameras it is about, and the figure that shows them; `said` is what the paper says of these."""

    scenario: Scenario
    figure: str
    said: str
    rows: tuple[PrintedGroups, ...]


TABLE_2 = PrintedTable(
    hall("Scenario 1", SCENARIO_1),
    "Fig. 5",
    "different positions and orientations",
    (
        PrintedGroups((0, 4), ((1, 2), (3, 4, 5))),
        PrintedGroups((5, 10), ((1, 2, 3), (4, 5))),
    ),
)
TABLE_3 = PrintedTable(
    hall("Scenario 2", SCENARIO_2),
    "Fig. 6",
    "one height",
    (
        PrintedGroups((0, 3), ((1, 2, 3, 7), (4, 5, 6, 8, 9, 10))),
        PrintedGroups((4, 4), ((1, 2, 3, 6, 7, 8), (4, 5, 9, 10))),
        PrintedGroups((5, 5), ((1, 2, 6, 7, 8), (3, 4, 5, 9, 10))),
        PrintedGroups((6, 6), ((1, 6, 7), (2, 3, 4, 5, 8, 9, 10))),
        PrintedGroups((7, 10), ((1, 6), (2, 3, 4, 5, 7, 8, 9, 10))),
    ),
)
TABLES: Mapping[str, PrintedTable] = {"Table II": TABLE_2, "Table III": TABLE_3}
_HEADS = ("alpha", "group 1, printed", "group 1, ours", "group 2, printed", "group 2, ours")
_SIMILARITY = "0 <= s_ij <= 1 for every pair, s_ij = s_ji, s_ii = 1; alpha = 0.5"


def group_tables(tell: Tell, names: Sequence[str] = tuple(TABLES)) -> Chapter:
    """The chapter of the tables named."""
    items: list[Item] = []
    drawn: dict[str, bytes] = {}
    for name in names:
        table = TABLES[name]
        tell(f"{name} and {table.figure}: {table.scenario.name}")
        items += [*_table_items(name, table), *_figure_items(table)]
        number, place = len(name.removeprefix("Table ")), table.scenario.name.lower().replace(" ", "_")
        drawn |= {
            f"table_{number}.png": _text_table(name, table),
            f"table_{number}_groups.png": _groups_picture(name, table),
            f"fig_{table.figure[-1]}_{place}.png": _perspective(table),
        }
    return Chapter(tuple(items), drawn)


def margin(switches: Sequence[float]) -> float:
    """How far the nearest of `switches` is from a multiple of .1."""
    return min((abs(at - round(at, 1)) for at in switches), default=0.05)


def _table_items(name: str, table: PrintedTable) -> list[Item]:
    known = seen(table.scenario)
    items = []
    for row in table.rows:
        found = {grouped.groups(known, alpha, TWO) for alpha in row.alphas}
        ours = " or ".join(sorted(grouped.text(groups) for groups in found))
        items.append(Item(name, row.interval, grouped.text(row.groups), ours, found == {row.groups}))
    switches = grouped.switches(known, TWO)
    near = margin(switches)
    where = ", ".join(f"{at:.3f}" for at in switches)
    law = f"groups change at alpha = {where} only, and every printed alpha is {LEAST_MARGIN:g} or more from there"
    return [*items, Item(name, law, None, round(near, 4), len(switches) < len(table.rows) and near >= LEAST_MARGIN)]


def _figure_items(table: PrintedTable) -> list[Item]:
    vantages, position_m = table.scenario.vantages, table.scenario.position_m
    places, turns = len(np.unique(position_m, axis=0)), len({vantage.yaw_rad for vantage in vantages})
    heights = np.unique(position_m[:, 2])
    if table is TABLE_2:
        ours, holds = f"{places} positions, {turns} orientations", places == turns == len(vantages)
    else:
        ours, holds = ", ".join(f"{height:g} m" for height in heights), len(heights) == 1
    inside = bool(((position_m > 0) & (position_m < HALL_M)).all())
    S = seen(table.scenario).similarity(0.5, TWO)
    apart = S[~np.eye(len(S), dtype=bool)]
    bounded = bool((S == S.T).all() and (np.diag(S) == 1).all() and apart.min() >= 0 and apart.max() <= 1)
    return [
        Item(table.figure, f"{len(vantages)} cameras in the hall: {table.said}", table.said, ours, holds and inside),
        Item(table.figure, _SIMILARITY, None, f"{apart.min():.3f} to {apart.max():.3f}", bounded),
    ]


def _text_table(name: str, table: PrintedTable) -> bytes:
    rows = []
    for row in table.rows:
        ours = grouped.groups(seen(table.scenario), row.alphas[0], TWO)
        pairs = (grouped.text((group,)) for both in zip(row.groups, ours, strict=True) for group in both)
        rows.append((_typeset(row), *pairs))
    return plots.table(f"{name}: {table.scenario.name}, two groups", _HEADS, rows)


def _typeset(row: PrintedGroups) -> str:
    return row.interval.replace("alpha", "\N{GREEK SMALL LETTER ALPHA}").replace("<=", "\N{LESS-THAN OR EQUAL TO}")


def _groups_picture(name: str, table: PrintedTable) -> bytes:
    known = seen(table.scenario)
    stages = []
    for row in table.rows:
        found = grouped.labels(known, row.alphas[0], TWO)
        colour = {k + 1: int(label) for k, label in enumerate(found)}
        words = f"{_typeset(row)}: {grouped.text(grouped.members(found))}"
        stages.append(stage(table.scenario, words, colour, mutual=known.mutual))
    title = f"{name}: {table.scenario.name} from above\nLines: what two cameras see in common, grey between groups"
    return from_above(stages, title, ("group 1", "group 2"), columns=min(len(stages), 3))


def _perspective(table: PrintedTable) -> bytes:
    drawn = table.scenario
    colour = {k + 1: k for k in range(len(drawn.vantages))}
    title = f"{table.figure}: perspective of {drawn.name}"
    return perspective(stage(drawn, title, colour, mutual=seen(drawn).mutual), HALL_M[2])
