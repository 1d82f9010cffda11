"""`covista-station evaluate`."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

# What computes is imported when the command runs, so that `--help` and the other commands start at once.
if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from covista_service.evaluation.noise import PoseNoise
    from covista_service.evaluation.run import Evaluation, RunOptions


class MethodName(StrEnum):
    """Names of `methods.METHODS`, known without importing them."""

    AUTO = "auto"
    PLANES = "planes"
    SURFACE = "surface"
    FRUSTUM = "frustum"
    SNAVELY = "snavely"
    BRUCKNER = "bruckner"
    COSLAM = "coslam"
    HULL = "hull"
    DISTANCE = "distance"
    DENSE = "dense"
    DENSE_AT_JUMPS = "dense_at_jumps"


_DECIMALS = 3
# Of a table that goes to a file or a pipe.
_WIDTH = 130


def evaluate(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER...", help="Sets of images with known overlap.")],
    method: Annotated[
        list[MethodName] | None, typer.Option(help="How to measure; may be given again. \\[default: auto]")
    ] = None,
    input: Annotated[  # noqa: A002 - the flag's name
        Literal["images", "features", "features+thumbnails"], typer.Option(help="What a method is given of each image.")
    ] = "images",
    features: Annotated[Literal["rootsift", "orb"], typer.Option(help="Kind of features.")] = "rootsift",
    pose_noise: Annotated[
        str, typer.Option(metavar="DEG,SHARE", help="Errors put on poses: degrees, share of the median depth.")
    ] = "0,0",
    seeds: Annotated[int, typer.Option(min=1, help="Repeat with this many seeds.")] = 1,
    figures: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Where to put plots and overlays, as PNG.")
    ] = None,
    format: Annotated[Literal["table", "json"], typer.Option(help="What to write to stdout.")] = "table",  # noqa: A002 - the flag's name
) -> None:
    """Compare ways to measure the common field of view on recordings whose overlap is known."""
    import json

    from covista_schemas.errors import CovistaError
    from covista_schemas.messages import FeatureKind
    from rich.console import Console

    from covista_service.evaluation.files import make_folder
    from covista_service.evaluation.run import RunOptions

    options = RunOptions(
        tuple(dict.fromkeys(method or [MethodName.AUTO])),
        input,
        FeatureKind(features),
        parse_noise(pose_noise),
        seeds,
    )
    console = Console(stderr=True)
    try:
        if figures is not None:
            make_folder(figures)
        evaluations = _run(folders, options, figures, console)
    except CovistaError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from error
    if format == "json":
        typer.echo(json.dumps([each.as_json() for each in evaluations], allow_nan=False))
    else:
        out = Console(width=None if Console().is_terminal else _WIDTH)
        out.print(_table(evaluations))


def parse_noise(text: str) -> PoseNoise:
    """DEG,SHARE as on the command line."""
    from covista_service.evaluation.noise import PoseNoise

    try:
        deg, share = (float(part) for part in text.split(","))
    except ValueError as error:
        raise typer.BadParameter(f"{text!r} is not DEG,SHARE, as in 3,0.03", param_hint="--pose-noise") from error
    if not (0 <= deg <= 180 and 0 <= share < float("inf")):
        raise typer.BadParameter("DEG is from 0 to 180, SHARE 0 or more", param_hint="--pose-noise")
    return PoseNoise(deg, share)


def _run(folders: list[Path], options: RunOptions, drawn: Path | None, console: Console) -> list[Evaluation]:
    from rich.progress import Progress

    from covista_service.drawing.plots import need_matplotlib
    from covista_service.evaluation import figures
    from covista_service.evaluation.datasets import load
    from covista_service.evaluation.run import evaluate as run
    from covista_service.evaluation.run import steps

    if drawn is not None:
        need_matplotlib()
    datasets = [load(folder) for folder in folders]
    evaluations: list[Evaluation] = []
    with Progress(console=console, transient=True) as progress:
        for dataset in datasets:
            task = progress.add_task(dataset.name, total=steps(dataset, options))
            found = list(run(dataset, options, partial(progress.advance, task)))
            if drawn is not None:
                figures.write_set(drawn, dataset, found)
            evaluations += found
    if drawn is not None:
        figures.write_overview(drawn, evaluations)
    return evaluations


def _table(evaluations: list[Evaluation]) -> Table:
    from rich.table import Table

    table = Table()
    for title in ("set", "method", "seed"):
        table.add_column(title, no_wrap=True)
    for title in (
        "ordered pairs",
        "mean error",
        "where found",
        "rank order",
        "found",
        "in 90 %",
        "width",
        "ms per pair",
    ):
        table.add_column(title, justify="right")
    for each in evaluations:
        found = each.metrics
        table.add_row(
            each.dataset,
            each.method,
            str(each.seed),
            str(found.pairs),
            *(_figure(value) for value in (found.mae, found.mae_found, found.rank_correlation)),
            *("" if share is None else f"{share:.0%}" for share in (found.found_share, found.interval_coverage)),
            _figure(found.interval_width),
            _figure(found.ms_median),
        )
    return table


def _figure(value: float | None) -> str:
    return "" if value is None else f"{value:.{_DECIMALS}f}"
