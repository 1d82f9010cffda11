"""Questions to a station over HTTP about what is."""

from __future__ import annotations

from typing import Annotated

import typer

from covista_clients.commands import tables
from covista_clients.commands.options import DEFAULT_URL, Authorities, Format, Output, Token, Url, station
from covista_clients.commands.showing import show, tell_if_starting


def robots(url: Url = DEFAULT_URL, token: Token = None, ca: Authorities = None, output: Output = Format.TABLE) -> None:
    """Say which robots there are, where they stand, and what became of their messages."""
    with station(url, token, ca) as control:
        found = control.robots()
        show(found, tables.robots, output)
        if not found.robots:
            tell_if_starting(control)


def pairs(
    url: Url = DEFAULT_URL,
    token: Token = None,
    ca: Authorities = None,
    output: Output = Format.TABLE,
    robot: Annotated[str | None, typer.Option(help="Only pairs of this robot.")] = None,
    min_overlap: Annotated[
        float | None,
        typer.Option(min=0, max=1, help="Only pairs of which one image shares at least this with the other."),
    ] = None,
) -> None:
    """Say how much each pair of robots sees in common, and how that is known."""
    with station(url, token, ca) as control:
        found = control.pairs(robot, min_overlap)
        show(found, tables.pairs, output)
        if not found.pairs:
            tell_if_starting(control)


def similarity(
    url: Url = DEFAULT_URL, token: Token = None, ca: Authorities = None, output: Output = Format.TABLE
) -> None:
    """Say how similar all robots are, which is what they are grouped by."""
    with station(url, token, ca) as control:
        show(control.similarity(), tables.similarity, output)


def groups(url: Url = DEFAULT_URL, token: Token = None, ca: Authorities = None, output: Output = Format.TABLE) -> None:
    """Say which robots belong together."""
    with station(url, token, ca) as control:
        found = control.groups()
        show(found, tables.groups, output)
        if not found.groups:
            tell_if_starting(control)


def forget(
    robot: Annotated[str, typer.Argument(help="Id of the robot.")],
    url: Url = DEFAULT_URL,
    token: Token = None,
    ca: Authorities = None,
) -> None:
    """Have the station forget a robot, at once; one that goes on sending is a new one."""
    with station(url, token, ca) as control:
        control.forget(robot)
    print(f"{robot} is forgotten")
