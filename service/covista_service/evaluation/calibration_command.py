"""`covista-station calibrate`: fit the constants behind intervals to recordings, and judge them on sets left out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

# What computes is imported when the command runs, so that `--help` and the other commands start at once.
if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from covista_service.evaluation.calibration import Mask, Trials
    from covista_service.evaluation.run import RunOptions
    from covista_service.perception.camera import Floats
    from covista_service.perception.certainty import CertaintyOptions

_WIDTH = 110
_LEVELS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)


def calibrate(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER...", help="Sets of images with known overlap.")],
    input: Annotated[  # noqa: A002 - the flag's name
        Literal["features", "features+thumbnails"], typer.Option(help="What is given of each image.")
    ] = "features+thumbnails",
    pose_noise: Annotated[
        str, typer.Option(metavar="DEG,SHARE", help="Errors that poses have in the second half of the trials.")
    ] = "3,0.03",
    seeds: Annotated[int, typer.Option(min=1, help="With how many draws of such errors.")] = 1,
    figures: Annotated[Path | None, typer.Option(metavar="FOLDER", help="Where to draw calibration.png.")] = None,
) -> None:
    """Fit how sure an overlap is to recordings whose overlap is known; leave out each kind of set to judge it."""
    from rich.console import Console

    from covista_service.evaluation.calibration import fit, left_out
    from covista_service.evaluation.command import parse_noise
    from covista_service.evaluation.files import DatasetError, make_folder
    from covista_service.evaluation.run import RunOptions

    options = RunOptions(input=input, noise=parse_noise(pose_noise), seeds=seeds)
    try:
        if figures is not None:
            make_folder(figures)
        trials = _trials(folders, options, Console(stderr=True))
    except DatasetError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from error
    kinds = len(set(trials.kinds.tolist()))
    if kinds < 2:
        typer.echo(
            f"Sets with cameras, of two kinds or more, are needed, and these are of {kinds}: each kind is judged by "
            "constants fitted to the others. Sets whose names differ in a number at the end alone are of one kind.",
            err=True,
        )
        raise typer.Exit(1)
    out = Console(width=None if Console().is_terminal else _WIDTH)
    judged = left_out(trials, _LEVELS)
    out.print(_table(trials, judged[_LEVELS.index(0.9)]))
    out.print(_constants(fit(trials)), highlight=False)
    if figures is not None:
        _draw(trials, judged, figures)


def _trials(folders: list[Path], options: RunOptions, console: Console) -> Trials:
    from rich.progress import Progress

    from covista_service.evaluation.calibration import joined, tried
    from covista_service.evaluation.datasets import load
    from covista_service.evaluation.run import viewed
    from covista_service.perception.scene import SceneOptions, reconstruct

    found = []
    datasets = [load(folder) for folder in folders]
    with Progress(console=console, transient=True) as progress:
        for dataset in progress.track(datasets):
            for noise, views in viewed(dataset, options):
                scene = reconstruct(views, dataset.pairs, SceneOptions())
                found.append(tried(dataset.name, dataset.truth, dataset.pairs, scene, noisy=not noise.is_none))
    return joined(found)


def _table(trials: Trials, judged: Floats) -> Table:
    """Coverage and mean width of `judged` intervals (2, n)."""
    import numpy as np
    from rich.table import Table

    table = Table(title="90 % intervals, each kind of set judged by constants fitted to the others")
    table.add_column("set", no_wrap=True)
    halves = {"poses exact": ~trials.noisy, "poses off": trials.noisy}
    for title in halves:
        for part in (f"{title}: pairs", "held", "width"):
            table.add_column(part, justify="right")
    kinds = {str(name): trials.kinds == name for name in np.unique(trials.kinds)}
    unsure = ~trials.matched & trials.doubtful
    groups = {"all": np.ones(len(trials), np.bool_), "matched": trials.matched, "predicted": ~trials.matched}
    for title, rows in {**kinds, **groups, "predicted, may meet": unsure}.items():
        cells = [_cells(trials.only(rows & half), judged[:, rows & half]) for half in halves.values()]
        table.add_row(title, *cells[0], *cells[1])
    return table


def _cells(trials: Trials, judged: Floats) -> tuple[str, str, str]:
    if not len(trials):
        return "0", "", ""
    low, high = judged
    held: Mask = (low <= trials.truth) & (trials.truth <= high)
    return str(len(trials)), f"{held.mean():.0%}", f"{(high - low).mean():.3f}"


def _constants(options: CertaintyOptions) -> str:
    """What to put into `CertaintyOptions`."""
    from dataclasses import asdict

    lines = [f"    {name}: float = {value:.3g}" for name, value in asdict(options).items()]
    return "\n".join(("The constants of perception/certainty.py, fitted to all:", *lines))


def _draw(trials: Trials, judged: Floats, folder: Path) -> None:
    import numpy as np

    from covista_service.drawing.calibration_plot import calibration_plot

    held = (judged[:, 0] <= trials.truth) & (trials.truth <= judged[:, 1])
    widths = np.diff(judged[_LEVELS.index(0.9)], axis=0)[0]
    # Answers beyond doubt hold at any level, and say nothing about it.
    halves = {"poses exact": ~trials.noisy & trials.doubtful, "poses off": trials.noisy & trials.doubtful}
    curves = {title: held[:, half].mean(axis=1) for title, half in halves.items() if half.any()}
    may_meet = ~trials.matched & trials.doubtful
    groups = {"matched": widths[trials.matched], "predicted, may meet": widths[may_meet]}
    (folder / "calibration.png").write_bytes(calibration_plot(_LEVELS, curves, groups))
