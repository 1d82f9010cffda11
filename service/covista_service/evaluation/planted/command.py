"""`covista-station planted`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

# Of a table that goes to a file or a pipe.
_WIDTH = 150


def planted(
    out: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Where to put planted.json and plots, as PNG.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="How many swarms.")] = 216,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first; 0 to 143 chose the parameters.")] = 1000,
    largest: Annotated[int, typer.Option(min=81, max=1000, help="Robots of the largest swarm.")] = 200,
    rendered: Annotated[int, typer.Option(min=0, help="How many swarms more, before rendered worlds.")] = 4,
    drives: Annotated[int, typer.Option(min=0, help="How many movers drive through noisy swarms of each size.")] = 8,
    format: Annotated[Literal["table", "json"], typer.Option(help="What to write to stdout.")] = "table",  # noqa: A002 - the flag's name
) -> None:
    """Group swarms whose groups were planted, and say how well each method finds them."""
    # What computes is imported when the command runs, so that `--help` and the other commands start at once.
    from covista_schemas.errors import CovistaError
    from rich.console import Console

    from covista_service.drawing.plots import need_matplotlib
    from covista_service.evaluation.files import make_folder
    from covista_service.evaluation.planted import report
    from covista_service.evaluation.planted.run import RunOptions, moving, run

    options = RunOptions(seeds, first_seed, largest, rendered, drives)
    try:
        if out is not None:
            need_matplotlib()
            make_folder(out)
        trials = list(run(options, lambda line: typer.echo(line, err=True)))
        moved = moving(options, lambda line: typer.echo(line, err=True))
        if out is not None:
            report.write(out, options, trials, moved)
    except CovistaError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from error
    if format == "json":
        typer.echo(report.as_json(options, trials, moved))
        return
    console = Console(width=None if Console().is_terminal else _WIDTH)
    for table in report.tables(options, trials, moved):
        console.print(table)
