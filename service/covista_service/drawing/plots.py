"""Plots and tables of figures, as PNG bytes; matplotlib, of the extra `bench`, is imported when one is drawn.

Colours are Okabe and Ito's, and what a colour says a label says too.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from covista_schemas.errors import MissingExtraError
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

INK, PENCIL = "#282828", "#8a8a8a"
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#7F7F7F")
_DASHES = ("-", "--", ":", "-.")
_COLUMNS = 4
_PANEL_IN = 3.1
_BAR_IN = 0.4
_LETTERS_PER_BAR = 5
_ROW_IN = 0.27
_DPI = 110
_STYLE = {
    "font.size": 10,
    "axes.titlesize": 10,
    "axes.edgecolor": PENCIL,
    "axes.labelcolor": INK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e4e4e4",
    "legend.frameon": False,
}


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One method's answers (n,) against the truth (n,)."""

    title: str
    truth: Floats
    given: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A line through points x (n,), y (n,)."""

    label: str
    x: Floats
    y: Floats


def need_matplotlib() -> None:
    """Raise MissingExtraError where matplotlib is not installed, before anything is computed for it."""
    try:
        import matplotlib  # noqa: F401 - to see whether it is there
    except ImportError as error:
        raise MissingExtraError("drawing plots", "bench") from error


def scatters(panels: Sequence[Panel], title: str, x_label: str, y_label: str) -> bytes:
    """A panel per method, all on the same square; the line is where an answer equals the truth."""
    columns = min(_COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    with styled():
        figure = blank(_PANEL_IN * columns + 0.4, _PANEL_IN * rows + 0.8)
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid.ravel()[len(panels) :]:
            axes.set_axis_off()
        for axes, panel in zip(grid.ravel(), panels, strict=False):
            _scatter(axes, panel)
            axes.tick_params(labelbottom=True, labelleft=True)
        figure.suptitle(title)
        figure.supxlabel(x_label, fontsize=10)
        figure.supylabel(y_label, fontsize=10)
        return png(figure)


def bars(groups: Sequence[str], series: Mapping[str, Sequence[float | None]], title: str, y_label: str) -> bytes:
    """Bars of each series side by side, group by group; None has no bar."""
    width = 0.8 / max(len(series), 1)
    with styled():
        figure = blank(max(6.0, 1.2 + _BAR_IN * len(groups) * (len(series) + 1)), 4.2)
        axes = figure.subplots()
        for k, (name, values) in enumerate(series.items()):
            places = np.arange(len(groups)) + (k - (len(series) - 1) / 2) * width
            heights = [0.0 if value is None else value for value in values]
            drawn = axes.bar(places, heights, 0.92 * width, label=name, color=COLOURS[k % len(COLOURS)])
            labels = ["-" if value is None else f"{value:.3f}".lstrip("0") for value in values]
            axes.bar_label(drawn, labels, fontsize=8, padding=1)
        crowded = max(map(len, groups)) > _LETTERS_PER_BAR * (len(series) + 1)
        axes.set_xticks(np.arange(len(groups)), groups)
        if crowded:
            axes.tick_params("x", labelrotation=20)
        axes.grid(visible=False, axis="x")
        axes.margins(y=0.15)
        axes.set_ylabel(y_label)
        axes.set_title(title)
        if len(series) > 1:
            figure.legend(loc="outside lower center", ncols=min(len(series), 4))
        return png(figure)


def boxes(series: Mapping[str, Floats], title: str, y_label: str) -> bytes:
    """How the values of each series spread: median, quartiles, whiskers to 5 and 95 %, the mean as a diamond."""
    with styled():
        figure = blank(max(4.0, 1.4 + 0.9 * len(series)), 4.2)
        axes = figure.subplots()
        drawn = axes.boxplot(
            list(series.values()),
            tick_labels=list(series),
            whis=(5, 95),
            showmeans=True,
            patch_artist=True,
            widths=0.55,
            medianprops={"color": INK, "linewidth": 1.6},
            meanprops={"marker": "D", "markerfacecolor": "white", "markeredgecolor": INK, "markersize": 5},
            flierprops={"marker": ".", "markersize": 4, "markeredgecolor": PENCIL},
        )
        for k, box in enumerate(drawn["boxes"]):
            box.set(facecolor=COLOURS[k % len(COLOURS)], alpha=0.65)
        axes.set_ylim(bottom=0)
        axes.grid(visible=False, axis="x")
        axes.set_ylabel(y_label)
        axes.set_title(title)
        return png(figure)


def curves(
    panels: Mapping[str, Sequence[Curve]],
    title: str,
    x_label: str,
    y_label: str,
    x_scale: Literal["log", "linear"] = "log",
    top: float = 1.0,
) -> bytes:
    """Panels, by title, of curves, y from 0 to `top`; one legend, that of the first panel, for all."""
    with styled():
        # Two columns of the legend need three panels.
        columns = 2 if len(panels) > 2 else 1
        figure = blank(_PANEL_IN * len(panels) + 0.6, _PANEL_IN + 1.0)
        grid = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for axes, (name, drawn) in zip(grid, panels.items(), strict=True):
            for k, curve in enumerate(drawn):
                # Earlier ones are wider, so that those which coincide are all seen.
                width = 1.6 + 1.2 * (len(drawn) - 1 - k)
                style = _DASHES[k % len(_DASHES)]
                axes.plot(curve.x, curve.y, style, color=COLOURS[k % len(COLOURS)], lw=width, label=curve.label)
            axes.set(xscale=x_scale, ylim=(-0.02 * top, 1.02 * top), title=name, xlabel=x_label)
        grid[0].set_ylabel(y_label)
        figure.suptitle(title)
        handles, labels = grid[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=columns, handlelength=3.5)
        return png(figure)


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> bytes:
    """A table with a head, whose texts may have more than one line; every column is as wide as its longest line."""
    longest = [
        max(len(line) for text in column for line in text.split("\n")) for column in zip(columns, *rows, strict=True)
    ]
    need_matplotlib()
    from matplotlib.transforms import Bbox

    widths = np.array(longest) + 3.0
    head = max(text.count("\n") for text in columns) + 1
    with styled():
        figure = blank(0.5 + 0.095 * widths.sum(), 0.45 + _ROW_IN * (len(rows) + head))
        axes = figure.subplots()
        axes.set_axis_off()
        axes.set_title(title, loc="left", fontsize=11)
        drawn = axes.table(
            [list(row) for row in rows],
            colLabels=list(columns),
            colWidths=(widths / widths.sum()).tolist(),
            cellLoc="left",
            bbox=Bbox.unit(),
        )
        drawn.auto_set_font_size(False)
        drawn.set_fontsize(10)
        for (row, _), cell in drawn.get_celld().items():
            cell.set(edgecolor="#d0d0d0", facecolor="white" if row else "#eef2f6")
            cell.set_height((1 if row else head) / (len(rows) + head))
            cell.get_text().set_fontweight("normal" if row else "bold")
        return png(figure)


def _scatter(axes: Axes, panel: Panel) -> None:
    axes.plot((0, 1), (0, 1), color=PENCIL, lw=1)
    axes.scatter(panel.truth, panel.given, s=14, alpha=0.55, color=COLOURS[0], linewidths=0, clip_on=False, zorder=3)
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal", title=panel.title)
    axes.set_xticks(np.linspace(0, 1, 6))
    axes.set_yticks(np.linspace(0, 1, 6))


def styled() -> AbstractContextManager[None]:
    """While it holds, what is drawn has this module's looks; raises MissingExtraError without matplotlib."""
    need_matplotlib()
    from matplotlib import rc_context

    return rc_context(_STYLE)  # type: ignore[arg-type]  # its keys are literal types from 3.11 on, strings before


def blank(width_in: float, height_in: float) -> Figure:
    """A figure that draws itself with Agg: no window system, and none of pyplot's state."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), dpi=_DPI, layout="constrained")


def png(figure: Figure) -> bytes:
    """The figure as PNG bytes."""
    buffer = io.BytesIO()
    # Without the version in it the same figures give the same bytes everywhere.
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()
