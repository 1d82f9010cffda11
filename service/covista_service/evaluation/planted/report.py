"""The figures of planted swarms as a table, as JSON and as plots."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from covista_service.evaluation.files import make_folder
from covista_service.evaluation.planted import mover
from covista_service.evaluation.planted.run import RunOptions
from covista_service.evaluation.planted.trial import Figures, Trial, figures, size_classes
from covista_service.grouping.selection import SelectionOptions

if TYPE_CHECKING:
    from rich.table import Table


def as_json(options: RunOptions, trials: Sequence[Trial], moved: Sequence[mover.Row]) -> str:
    """The setting, the figures of every variant and method, those of noisy movers, and every trial."""
    found = {
        "setting": asdict(options),
        "figures": [each.as_json() for each in figures(trials, options.largest)],
        "movers": [asdict(row) for row in moved],
        "trials": [asdict(trial) for trial in trials],
    }
    return json.dumps(found, allow_nan=False)


def write(folder: Path, options: RunOptions, trials: Sequence[Trial], moved: Sequence[mover.Row]) -> None:
    """planted.json; for each variant two plots, the ARI over classes of size and how it spreads; one of a mover."""
    from covista_service.drawing import plots
    from covista_service.drawing.class_plot import class_plot

    make_folder(folder)
    (folder / "planted.json").write_text(as_json(options, trials, moved) + "\n", encoding="utf-8")
    if moved:
        lines = mover.timelines(SelectionOptions(), seed=options.first_seed)
        (folder / "mover.png").write_bytes(mover.plot(lines))
    found = figures(trials, options.largest)
    for variant in dict.fromkeys(each.variant for each in found):
        here = [each for each in found if each.variant == variant]
        names = [name for name in size_classes(options.largest) if any(each.by_size[name] is not None for each in here)]
        series = {each.method: [each.by_size[name] for name in names] for each in here}
        title = f"Grouping of planted swarms: {variant}"
        by_size = class_plot(names, series, title, "mean adjusted Rand index")
        (folder / f"{variant}_by_size.png").write_bytes(by_size)
        spread = {
            each.method: np.array([t.ari for t in trials if (t.variant, t.method) == (variant, each.method)])
            for each in here
        }
        (folder / f"{variant}_spread.png").write_bytes(plots.boxes(spread, title, "adjusted Rand index"))


def tables(options: RunOptions, trials: Sequence[Trial], moved: Sequence[mover.Row]) -> list[Table]:
    """A table of every variant, and one of noisy movers."""
    found = figures(trials, options.largest)
    variants = dict.fromkeys(each.variant for each in found)
    of_variants = [_table(variant, [each for each in found if each.variant == variant]) for variant in variants]
    return [*of_variants, _movers(moved)] if moved else of_variants


def _movers(moved: Sequence[mover.Row]) -> Table:
    from rich.table import Table

    table = Table(title="a noisy mover: changes of labels per 100 steps of 1 s")
    for title in ("criterion", "robots", "shown"):
        table.add_column(title, no_wrap=True)
    for title in ("changes", "of others", "truly", "lag s", "astray"):
        table.add_column(title, justify="right")
    for row in moved:
        counts = (row.changes_per_100, row.others_per_100, row.true_per_100, row.lag_steps)
        figures_of_row = [f"{value:.1f}" for value in counts]
        table.add_row(row.criterion, str(row.robots), row.setting, *figures_of_row, f"{row.astray:.2f}")
    return table


def _table(variant: str, found: Sequence[Figures]) -> Table:
    """A row per method; columns in which there is nothing are left out."""
    from rich.table import Table

    columns = {title: texts for title, texts in _columns(found).items() if any(texts)}
    table = Table(title=f"{variant}: adjusted Rand index over {found[0].swarms} swarm{'s' * (found[0].swarms != 1)}")
    table.add_column("method", no_wrap=True)
    for title in columns:
        table.add_column(title, justify="right")
    for k, each in enumerate(found):
        table.add_row(each.method, *(texts[k] for texts in columns.values()))
    return table


def _columns(found: Sequence[Figures]) -> dict[str, list[str]]:
    """What stands under each title, method by method."""
    return {
        "mean": [_figure(each.ari) for each in found],
        "10 %": [_figure(each.tenth) for each in found],
        **{size: [_figure(each.by_size[size]) for each in found] for size in found[0].by_size},
        "> 30": [_figure(each.above_30) for each in found],
        **{kind: [_figure(each.by_kind[kind]) for each in found] for kind in found[0].by_kind},
        "one kept": [_figure(each.kept_one) for each in found],
        "apart kept": [_figure(each.kept_apart) for each in found],
        "ms": [f"{each.ms_median:.2f}" for each in found],
    }


def _figure(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
