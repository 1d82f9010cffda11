"""`covista-station demo`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Literal

import typer

# What computes is imported when the command runs, so that `--help` and the other commands start at once.
if TYPE_CHECKING:
    from covista_service.demo.run import Screen

WorldName = Literal["corner", "boxes", "shelf", "wall", "arena"]
# Where a line cannot be rewritten in place, every so many of them are written.
_EVERY = 10


def demo(
    robots: Annotated[int, typer.Option(min=1, max=200, help="How many simulated rovers.")] = 6,
    world: Annotated[WorldName, typer.Option(help="Where they drive.")] = "arena",
    seconds: Annotated[
        float | None, typer.Option(min=0, help="How long; without it until Ctrl-C.", show_default=False)
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same swarm.")] = 0,
    api: Annotated[
        str, typer.Option(metavar="HOST:PORT", envvar="COVISTA_API", help="Where the REST interface listens.")
    ] = "127.0.0.1:8000",
    link: Annotated[
        str, typer.Option(metavar="ENDPOINT", envvar="COVISTA_LINK", help="Where zenoh listens.")
    ] = "tcp/127.0.0.1:7447",
    database: Annotated[
        str | None, typer.Option(metavar="URL", help="Keep the history there.  [default: a temporary file]")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", dir_okay=False, writable=True, help="Write what came of it, as JSON.")
    ] = None,
) -> None:
    """Show a station and a simulated swarm at work, each a process of its own."""
    from covista_clients.simulation.swarm import SwarmOptions
    from covista_schemas.errors import CovistaError

    from covista_service import config
    from covista_service.demo.run import DemoOptions, run

    if report is not None and not report.parent.is_dir():
        raise typer.BadParameter(f"there is no folder {report.parent}", param_hint="--report")
    with ExitStack() as stack:
        if database is None:
            folder = stack.enter_context(TemporaryDirectory(prefix="covista-", ignore_cleanup_errors=True))
            database = f"sqlite:///{folder}/covista.db"
        try:
            settings = config.load({"api": api, "link": link, "database": database, "log_level": "warning"})
            swarm = SwarmOptions(robots=robots, world=world, seed=seed, connect=settings.link[0], site=settings.site)
            result = run(DemoOptions(swarm, settings, seconds, report is not None), stack.enter_context(_screen()))
        except CovistaError as error:
            typer.echo(str(error), err=True)
            raise typer.Exit(1) from error
        if report is not None and result is not None:
            report.write_text(json.dumps(result.as_json(), allow_nan=False, indent=1) + "\n", "utf-8")


@contextmanager
def _screen() -> Iterator[Screen]:
    """What stays goes to lines, progress to the last line of a terminal, or now and then to a line."""
    from rich.console import Console

    from covista_service.demo.run import Screen

    console = Console(highlight=False, markup=False, soft_wrap=True)
    if console.is_terminal:
        with console.status("starting") as status:
            yield Screen(console.print, status.update)
        return
    told = 0

    def now_and_then(text: str) -> None:
        nonlocal told
        if told % _EVERY == 0:
            typer.echo(text)
        told += 1

    yield Screen(typer.echo, now_and_then)
