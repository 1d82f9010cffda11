"""Do intervals hold what they promise, and how wide are they: PNG bytes, by matplotlib (extra `bench`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

# Okabe and Ito's blue and vermilion: colour-blind people tell them apart.
_COLOURS = ("#0072b2", "#d55e00")


def calibration_plot(
    nominal: Sequence[float],
    held: Mapping[str, NDArray[np.float64]],
    widths: Mapping[str, NDArray[np.float64]],
) -> bytes:
    """Left: share of intervals that hold the truth over the share that should (each `held` (len(nominal),)).

    Right: how wide the intervals of each group are, `widths` (n,).
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    left.plot([0, 1], [0, 1], color="0.7", linewidth=1)
    for (label, shares), colour in zip(held.items(), _COLOURS, strict=False):
        left.plot(nominal, shares, marker="o", markersize=4, label=label, color=colour)
    left.set(xlabel="interval promises", ylabel="and holds", xlim=(0, 1), ylim=(0, 1), aspect="equal")
    bins = np.linspace(0, 0.6, 25)
    for (label, values), colour in zip(widths.items(), _COLOURS, strict=False):
        label = f"{label} (mean {values.mean():.2f})" if len(values) else label
        share = np.full(len(values), 1 / max(len(values), 1))
        kept = np.minimum(values, bins[-1])
        right.hist(kept, bins.tolist(), weights=share, histtype="step", label=label, color=colour, linewidth=1.5)
    right.set(xlabel="width of the 90 % interval (last: and wider)", ylabel="share of ordered pairs", xlim=(0, 0.6))
    for axes in (left, right):
        axes.legend(frameon=False, fontsize=9)
        axes.spines[["top", "right"]].set_visible(False)
    png = BytesIO()
    figure.savefig(png, format="png", dpi=110, metadata={"Software": None})
    return png.getvalue()
