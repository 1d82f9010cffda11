"""What was seen of a station in a soak, over time: PNG bytes; matplotlib, of the extra `bench`, is imported here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from covista_service.bench.soak_judge import Judged
from covista_service.bench.trend import LEFT_OUT
from covista_service.drawing.plots import COLOURS, INK, PENCIL, blank, png, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLUMNS = 2
_WIDTH_IN, _PANEL_IN = 10.0, 2.0


@dataclass(frozen=True, slots=True)
class Panel:
    """One thing that was seen, (s, value), and how it was judged by its trend, if it was."""

    name: str
    points: Sequence[tuple[float, float]]
    judged: Judged | None = None


def drawn(panels: Sequence[Panel]) -> bytes:
    """A panel for each, and the line that its trend is judged by."""
    rows = -(-len(panels) // _COLUMNS)
    with styled():
        figure = blank(_WIDTH_IN, 0.4 + _PANEL_IN * rows)
        grid = figure.subplots(rows, _COLUMNS, sharex=True, squeeze=False)
        for axes, panel in zip(grid.ravel(), panels, strict=False):
            _draw(axes, panel)
        for axes in grid[-1]:
            axes.set_xlabel("minutes")
        return png(figure)


def _draw(axes: Axes, panel: Panel) -> None:
    at_min, values = np.array(panel.points).T * [[1 / 60], [1]]
    axes.plot(at_min, values, ".", ms=2.5, color=COLOURS[0])
    axes.set_ylim(0, 1.15 * max(float(values.max()), 1e-3))
    if panel.judged is None:
        axes.set_title(panel.name, loc="left")
        return
    trend, verdict = panel.judged.trend, panel.judged.verdict
    kept = slice(round(LEFT_OUT * len(values)), None)
    middle = at_min[kept].mean()
    line = values[kept].mean() + trend.slope / 60 * (at_min[kept] - middle)
    axes.plot(at_min[kept], line, color=COLOURS[1] if verdict == "flat" else INK, lw=1.5)
    axes.axvline(at_min[kept][0], color=PENCIL, lw=0.8, ls=":")
    told = f"{trend.grown:+.2g} ± {trend.unsure:.2g} in all, {verdict}"
    axes.set_title(f"{panel.name}: {told}", loc="left")
