"""Labels of robots over time as bands: PNG bytes; matplotlib, of the extra `bench`, is imported when one is drawn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from covista_service.drawing.plots import COLOURS, INK, blank, png, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Labels = NDArray[np.intp]
_WIDTH_IN = 9.0
_ROBOT_IN = 0.12
_PANEL_IN = 0.5
# A label that is shown for fewer steps has no room for its name.
_NAMED_STEPS = 5
_DARK = ("#0072B2", "#D55E00", "#009E73", "#000000", "#7F7F7F")
# Robots alone.
_ALONE = "#dedede"


def bands(panels: Mapping[str, Labels], marked: Mapping[int, str], title: str, x_label: str) -> bytes:
    """Panels, by title, one below the other, of the numbers (T, N) of labels g1, g2, ...: a band per robot.

    A group has one colour in all of a panel, and its name where there is room; a robot alone is grey. Where there are
    many groups colours come again, so a gap parts two labels of a robot. `marked` names rows.
    """
    heights = [labels.shape[1] for labels in panels.values()]
    with styled():
        figure = blank(_WIDTH_IN, 0.6 + sum(_PANEL_IN + _ROBOT_IN * height for height in heights))
        grid = figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for axes, (name, labels) in zip(grid, panels.items(), strict=True):
            _draw(axes, labels)
            axes.set_yticks(list(marked), list(marked.values()))
            axes.set_title(name, loc="left")
        grid[-1].set_xlabel(x_label)
        figure.suptitle(title)
        return png(figure)


def _draw(axes: Axes, labels: Labels) -> None:
    """One panel: the cell of step t and robot i has its middle at (t, i)."""
    steps, count = labels.shape
    colours = _colours(labels)
    extent = (-0.5, steps - 0.5, count - 0.5, -0.5)
    axes.imshow(_pixels(colours).transpose(1, 0, 2), aspect="auto", interpolation="nearest", extent=extent)
    axes.hlines(np.arange(1, count) - 0.5, -0.5, steps - 0.5, color="white", lw=0.4)
    step, robot = np.nonzero(labels[1:] != labels[:-1])
    axes.vlines(step + 0.5, robot - 0.5, robot + 0.5, color="white", lw=1.6)
    axes.grid(visible=False)
    axes.tick_params("y", length=0)
    axes.spines[["left", "bottom"]].set_visible(False)
    for first, last, start, label in _blocks(labels):
        ink = "white" if colours[start][first] in _DARK else INK
        axes.text(start, (first + last) // 2, f"g{label}", color=ink, fontsize=6.5, va="center_baseline")


def _colours(labels: Labels) -> list[list[str]]:
    """Colours of T steps and N robots: groups take theirs in the order in which they appear."""
    colour_of: dict[int, str] = {}
    found = []
    for row in labels.tolist():
        members = Counter(row)
        for label in row:
            if members[label] > 1:
                colour_of.setdefault(label, COLOURS[len(colour_of) % len(COLOURS)])
        found.append([colour_of[label] if members[label] > 1 else _ALONE for label in row])
    return found


def _pixels(colours: Sequence[Sequence[str]]) -> NDArray[np.uint8]:
    return np.array([[list(bytes.fromhex(colour[1:])) for colour in row] for row in colours], np.uint8)


def _blocks(labels: Labels) -> list[tuple[int, int, int, int]]:
    """First and last robot, first step, and label of blocks: neighbours that have a label for the same steps."""
    begun: dict[tuple[int, int, int], int] = {}
    found = []
    for robot in range(labels.shape[1] + 1):
        runs = set(_runs(labels[:, robot])) if robot < labels.shape[1] else set()
        found += [(begun[run], robot - 1, run[0], run[2]) for run in begun.keys() - runs]
        begun = {run: begun.get(run, robot) for run in runs}
    return sorted(found)


def _runs(labels: Labels) -> list[tuple[int, int, int]]:
    """Start, end and label of what is long enough for a name, in the labels (T,) of one robot."""
    edges = np.concatenate([[0], np.flatnonzero(labels[1:] != labels[:-1]) + 1, [len(labels)]])
    spans = zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
    return [(start, end, int(labels[start])) for start, end in spans if end - start >= _NAMED_STEPS]
