"""How a figure of many methods goes over classes: PNG bytes, by matplotlib (extra `bench`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from covista_service.drawing.plots import COLOURS, blank, png, styled

# Those who share a colour, from the ninth method on, differ in dash and mark.
_DASHES = ("-", "--", ":")
_MARKS = ("o", "s", "^")
_APART_IN = 0.19
_HEIGHT_IN = 4.4
_LETTER_IN = 0.1


def class_plot(classes: Sequence[str], series: Mapping[str, Sequence[float | None]], title: str, y_label: str) -> bytes:
    """A line per method over classes, y from 0 to 1, named where it ends; None leaves a gap."""
    names_in = 0.4 + _LETTER_IN * max(map(len, series), default=0)
    with styled():
        figure = blank(2.0 + 1.2 * len(classes) + names_in, _HEIGHT_IN)
        axes = figure.subplots()
        places = np.arange(len(classes))
        ends: dict[str, float] = {}
        for k, (name, values) in enumerate(series.items()):
            heights = np.array([np.nan if value is None else value for value in values])
            lap = k // len(COLOURS)
            look, dash = _MARKS[lap % len(_MARKS)], _DASHES[lap % len(_DASHES)]
            colour = COLOURS[k % len(COLOURS)]
            # The first of them, what the others are compared with, lies on top.
            axes.plot(places, heights, look + dash, color=colour, markersize=5, lw=1.7, zorder=3 + len(series) - k)
            ends[name] = next((value for value in reversed(values) if value is not None), 0.0)
        axes.set(ylim=(-0.02, 1.02), xlim=(-0.3, len(classes) - 0.7), ylabel=y_label, title=title)
        axes.set_xticks(places, classes)
        for k, (name, place) in enumerate(_spread(ends).items()):
            axes.annotate(
                name,
                (len(classes) - 1, ends[name]),
                (len(classes) - 0.55, place),
                color=COLOURS[k % len(COLOURS)],
                va="center",
                annotation_clip=False,
                arrowprops={"arrowstyle": "-", "color": "#c8c8c8", "lw": 0.8, "shrinkB": 4},
            )
        return png(figure)


def _spread(ends: Mapping[str, float]) -> dict[str, float]:
    """Heights for names, near where their lines end and so far from one another that they can be read."""
    apart = _APART_IN / (_HEIGHT_IN - 1.0)
    order = sorted(ends, key=lambda name: ends[name])
    placed: dict[str, float] = {}
    for k, name in enumerate(order):
        floor = placed[order[k - 1]] + apart if k else -1.0
        placed[name] = max(ends[name], floor)
    over = max(placed.values(), default=0.0) - 1.0
    for k in range(len(order) - 1, -1, -1):
        # Pushed down from the top as far as need be.
        ceiling = placed[order[k + 1]] - apart if k + 1 < len(order) else 1.0
        placed[order[k]] = min(placed[order[k]], ceiling) if over > 0 else placed[order[k]]
    return {name: placed[name] for name in ends}
