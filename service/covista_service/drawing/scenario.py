"""Where cameras stand and what they look at, from above and from the side: PNG bytes, by matplotlib (extra `bench`).

A group is told by its colour and by the shape of its marks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from covista_service.drawing.plots import COLOURS, INK, PENCIL, blank, png, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

Floats = NDArray[np.float64]

_MARKS = ("o", "s", "^", "D", "v", "P", "X", "p")
_WIDEST_PT = 6.0
_FAINTEST = 0.02
_PANEL_IN = 4.6
_FLOOR = "#f4f4f4"
_CORNERS = np.array([(1.0, 0.6), (-1.0, 0.6), (1.0, -0.6), (-1.0, -0.6)])
# A label that is this share of the panel's width from the next mark or label has room.
_ENOUGH = 0.06
_SAMPLES = (0.1, 0.3, 0.5)


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """A camera at `place_m` (3,): corners of its image's rim (4, 3) in the world, and from above its view (k, 2)."""

    label: str
    place_m: Floats
    rim_m: Floats
    view_m: Floats
    group: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """A panel: the world's outline (4, 2) from above, cameras, and how much each two see in common (N, N) or None."""

    title: str
    outline_m: Floats
    standing: Sequence[Standing]
    mutual: Floats | None = None


def from_above(stages: Sequence[Stage], title: str, names: Sequence[str], columns: int = 2) -> bytes:
    """A panel per stage, all to the same scale; `names` of the groups go into a legend, by their numbers."""
    rows = -(-len(stages) // columns)
    with styled():
        figure = blank(_PANEL_IN * columns, (_height_in(stages[0]) + 0.35) * rows + 0.9)
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes in grid[len(stages) :]:
            axes.set_axis_off()
        for axes, stage in zip(grid, stages, strict=False):
            _draw_above(axes, stage)
        figure.suptitle(title)
        figure.legend(
            handles=[_key(k, name) for k, name in enumerate(names)],
            loc="outside lower center",
            ncols=min(len(names), 5),
        )
        return png(figure)


def perspective(stage: Stage, height_m: float) -> bytes:
    """The room from the side, `height_m` high, and beside it the same from above, with lines for what is common."""
    with styled():
        figure = blank(2.3 * _PANEL_IN, _height_in(stage) + 1.3)
        side, above = figure.subplots(1, 2, width_ratios=(1.3, 1))
        _draw_side(side, stage, height_m)
        _draw_above(above, stage)
        above.set_title("From above")
        figure.legend(handles=_widths(), loc="outside lower right", ncols=len(_SAMPLES))
        figure.suptitle(stage.title)
        return png(figure)


def _height_in(stage: Stage) -> float:
    width_m, height_m = np.ptp(stage.outline_m, axis=0).tolist()
    return float(_PANEL_IN * height_m / width_m)


def _key(group: int, name: str) -> Line2D:
    from matplotlib.lines import Line2D

    return Line2D([], [], ls="", marker=_mark(group), ms=9, mfc=_colour(group), mec=INK, label=name)


def _widths() -> list[Line2D]:
    from matplotlib.lines import Line2D

    label = "{:g} of their images in common"
    return [Line2D([], [], color=PENCIL, lw=_WIDEST_PT * share, label=label.format(share)) for share in _SAMPLES]


def _draw_above(axes: Axes, stage: Stage) -> None:
    for each in stage.standing:
        axes.fill(*each.view_m.T, color=_colour(each.group), alpha=0.10, lw=0)
        axes.fill(*each.view_m.T, fill=False, ec=_colour(each.group), lw=0.9, alpha=0.7)
    axes.fill(*stage.outline_m.T, fill=False, ec=PENCIL, lw=1.4)
    if stage.mutual is not None:
        _draw_lines(axes, stage.standing, stage.mutual)
    places = np.array([each.place_m[:2] for each in stage.standing])
    for each, place, side in zip(stage.standing, places, _sides(places, np.ptp(stage.outline_m, axis=0)), strict=True):
        _draw_mark(axes, each, place, side)
    axes.set(aspect="equal", title=stage.title, xlabel="x in m", ylabel="y in m")
    axes.margins(0.02)


def _draw_lines(axes: Axes, standing: Sequence[Standing], mutual: Floats) -> None:
    """Lines as wide as what two cameras see in common, in the group's colour if both are in one."""
    for j, one in enumerate(standing):
        for i, other in enumerate(standing[:j]):
            if mutual[i, j] > _FAINTEST:
                together = one.group == other.group
                ends = np.stack([one.place_m, other.place_m])
                axes.plot(
                    *ends[:, :2].T,
                    color=_colour(one.group) if together else PENCIL,
                    lw=_WIDEST_PT * mutual[i, j],
                    alpha=0.85 if together else 0.5,
                    solid_capstyle="round",
                )


def _draw_mark(axes: Axes, each: Standing, place: Floats, side: Floats) -> None:
    from matplotlib import patheffects

    axes.plot(*place, _mark(each.group), ms=8, mfc=_colour(each.group), mec=INK, mew=1, zorder=5)
    words = axes.annotate(
        each.label,
        (float(place[0]), float(place[1])),
        (7 * float(side[0]), 7 * float(side[1])),
        textcoords="offset points",
        ha="left" if side[0] > 0 else "right",
        va="bottom" if side[1] > 0 else "top",
        color=INK,
        weight="bold",
        zorder=6,
    )
    words.set_path_effects([patheffects.withStroke(linewidth=3, foreground="white")])


def _sides(places: Floats, extent: Floats) -> list[Floats]:
    """On which side of each mark its label has most room: (+-1, +-1) each, from places (N, 2) in a panel so large."""
    taken = [*places]
    found = []
    for k, place in enumerate(places):
        others = np.array([at for i, at in enumerate(taken) if i != k] or [place + extent])
        room = [np.linalg.norm((place + 0.04 * extent.max() * side - others), axis=1).min() for side in _CORNERS]
        # The first of equals, to the upper right.
        side = _CORNERS[int(np.argmax(np.minimum(room, _ENOUGH * extent.max())))]
        taken.append(place + 0.04 * extent.max() * side)
        found.append(side)
    return found


def _draw_side(axes: Axes, stage: Stage, height_m: float) -> None:
    eye = _Eye.before(stage.outline_m)
    floor = np.column_stack([stage.outline_m, np.zeros(4)])
    top = floor + np.array((0.0, 0.0, height_m))
    axes.fill(*eye.sees(floor).T, color=_FLOOR)
    for ring in (floor, top):
        axes.fill(*eye.sees(ring).T, fill=False, ec=PENCIL, lw=0.8)
    for foot, head in zip(floor, top, strict=True):
        axes.plot(*eye.sees(np.stack([foot, head])).T, color=PENCIL, lw=0.8)
    for each in stage.standing:
        ground = np.column_stack([each.view_m, np.zeros(len(each.view_m))])
        axes.fill(*eye.sees(ground).T, color=_colour(each.group), alpha=0.10, lw=0)
    places = eye.sees(np.array([each.place_m for each in stage.standing]))
    sides = _sides(places, np.ptp(eye.sees(np.vstack([floor, top])), axis=0))
    # The far ones first.
    order = np.argsort([-np.linalg.norm(each.place_m - eye.place_m) for each in stage.standing])
    for k in order.tolist():
        _draw_pyramid(axes, eye, stage.standing[k])
        _draw_mark(axes, stage.standing[k], places[k], sides[k])
    axes.set(aspect="equal", title="From the side; stalks: height above the floor")
    axes.set_axis_off()


def _draw_pyramid(axes: Axes, eye: _Eye, each: Standing) -> None:
    stalk = np.stack([each.place_m, each.place_m * (1, 1, 0)])
    axes.plot(*eye.sees(stalk).T, color=PENCIL, lw=1, ls=":")
    axes.plot(*eye.sees(stalk[1:]).T, ".", color=PENCIL, ms=4)
    axes.fill(*eye.sees(each.rim_m).T, fc=_colour(each.group), ec=INK, lw=0.9, alpha=0.55)
    for corner in each.rim_m:
        axes.plot(*eye.sees(np.stack([each.place_m, corner])).T, color=INK, lw=0.9)


@dataclass(frozen=True, slots=True, eq=False)
class _Eye:
    """A pinhole that looks at a room: `axes` (3, 3), rows right, up and ahead."""

    place_m: Floats
    axes: Floats

    @classmethod
    def before(cls, outline_m: Floats) -> _Eye:
        """Before the side with the least y and above it, somewhat to the left."""
        (x0, y0), (x1, y1) = outline_m.min(axis=0).tolist(), outline_m.max(axis=0).tolist()
        place = np.array([x0 + 0.35 * (x1 - x0), y0 - 1.0 * (y1 - y0), 1.15 * (y1 - y0)])
        ahead = np.array([(x0 + x1) / 2, (y0 + y1) / 2, 0.5]) - place
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, (0, 0, 1))
        right /= np.linalg.norm(right)
        return cls(place, np.stack([right, np.cross(right, ahead), ahead]))

    def sees(self, points_m: Floats) -> Floats:
        """Where points (n, 3) appear, (n, 2)."""
        right, up, ahead = self.axes @ (points_m - self.place_m).T
        return np.stack([right / ahead, up / ahead], axis=1)


def _colour(group: int) -> str:
    return COLOURS[group % len(COLOURS)]


def _mark(group: int) -> str:
    return _MARKS[group % len(_MARKS)]
