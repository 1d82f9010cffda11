"""The command `covista`: a simulated swarm, one keyframe by hand, and questions to a station."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import typer
from covista_schemas.errors import CovistaError

from covista_clients.commands import asking, recalling, sending, simulating, tuning, watching

app = typer.Typer(
    name="covista",
    help="Clients of a Covista station: who sees what in common, and who belongs together.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for command in (
    asking.robots,
    asking.pairs,
    asking.similarity,
    asking.groups,
    asking.forget,
    recalling.events,
    tuning.preview,
    watching.watch,
    sending.send,
    simulating.swarm,
    simulating.render,
):
    app.command()(command)
app.add_typer(recalling.history, name="history")
app.add_typer(tuning.settings, name="settings")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command; what goes wrong is said in one line on stderr, with exit code 1."""
    try:
        app(args=arguments, prog_name="covista")
    except CovistaError as error:
        print("covista:", " ".join(str(error).split()), file=sys.stderr)
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
