"""`covista-station paper`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

# What computes is imported when the command runs, so that `--help` and the other commands start at once.
if TYPE_CHECKING:
    from rich.table import Table

    from covista_service.evaluation.paper.chapter import Item, Value

# Of a table that goes to a file or a pipe.
_WIDTH = 140


def paper(
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where to put the pictures and paper.json.")],
) -> None:
    """Rebuild the paper's tables and figures, and compare them with what it prints."""
    from covista_schemas.errors import CovistaError
    from rich.console import Console

    from covista_service.drawing.plots import need_matplotlib
    from covista_service.evaluation.paper.run import EXPERIMENTS, run

    try:
        need_matplotlib()
        items = run(out, EXPERIMENTS, lambda line: typer.echo(line, err=True))
    except CovistaError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from error
    Console(width=None if Console().is_terminal else _WIDTH).print(_table(items))
    agreeing = sum(item.agrees for item in items)
    typer.echo(f"{agreeing} of {len(items)} agree; pictures and paper.json in {out}")


def _table(items: list[Item]) -> Table:
    from rich.table import Table

    table = Table()
    table.add_column("item", no_wrap=True)
    table.add_column("case, or the law checked")
    for title in ("printed", "ours"):
        table.add_column(title, justify="right")
    table.add_column("agrees")
    for item in items:
        table.add_row(item.item, item.case, _figure(item.printed), _figure(item.ours), "yes" if item.agrees else "no")
    return table


def _figure(value: Value) -> str:
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
