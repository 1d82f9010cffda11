"""`covista-station bench`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

# What computes is imported when the command runs, so that `--help` and the other commands start at once.
if TYPE_CHECKING:
    from rich.table import Table

    from covista_service.bench.row import Row

# Of a table that goes to a file or a pipe.
_WIDTH = 130


def bench(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Benchmarks, as survey or survey/cold_500.")
    ] = None,
    long: Annotated[bool, typer.Option("--long", help="In full, not in the short form.")] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 if a mark does not hold.")] = False,
    format: Annotated[Literal["table", "json"], typer.Option(help="What to write to stdout.")] = "table",  # noqa: A002 - the flag's name
) -> None:
    """Measure, beside what others offer, and say whether the marks hold."""
    import json
    import signal

    from covista_schemas.errors import CovistaError
    from rich.console import Console

    from covista_service.bench.runner import UnknownBenchError, run

    rows: list[Row] = []
    # As Ctrl-C: the processes that a bench has started end with it.
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with Console(stderr=True).status("measuring") as status:
            for row in run(names or (), long):
                rows.append(row)
                status.update(f"measuring; {row.bench}/{row.case}: {row.median:.3g} {row.unit}")
    except (UnknownBenchError, CovistaError) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from error
    finally:
        signal.signal(signal.SIGTERM, before)
    if format == "json":
        typer.echo(json.dumps([row.as_json() for row in rows], allow_nan=False))
    else:
        Console(width=None if Console().is_terminal else _WIDTH).print(_table(rows))
    if strict and not all(row.holds for row in rows):
        raise typer.Exit(1)


def _table(rows: list[Row]) -> Table:
    from rich.table import Table

    table = Table()
    table.add_column("bench/case", no_wrap=True)
    for title in ("median", "spread", "peer", "its median", "mark", "holds"):
        table.add_column(title)
    for row in rows:
        table.add_row(
            f"{row.bench}/{row.case}",
            f"{row.median:.3g} {row.unit}",
            "" if row.spread is None else f"{row.spread:.2g}",
            row.peer or "",
            "" if row.peer_median is None else f"{row.peer_median:.3g} {row.unit}",
            row.mark,
            "yes" if row.holds else "no",
        )
    return table
