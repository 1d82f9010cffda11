"""Questions to a station over HTTP."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, TypeVar

import typer
from covista_schemas.reports import Report
from rich.console import Console, RenderableType

from covista_clients.commands import tables
from covista_clients.commands.options import DEFAULT_URL, Format, Output, Token, Url
from covista_clients.mission_control import MissionControl

_R = TypeVar("_R", bound=Report)


def robots(url: Url = DEFAULT_URL, token: Token = None, output: Output = Format.TABLE) -> None:
    """Say which robots there are, where they stand, and what became of their messages."""
    with MissionControl(url, token) as control:
        _show(control.robots(), tables.robots, output)


def pairs(
    url: Url = DEFAULT_URL,
    token: Token = None,
    output: Output = Format.TABLE,
    robot: Annotated[str | None, typer.Option(help="Only pairs of this robot.")] = None,
    min_overlap: Annotated[
        float | None,
        typer.Option(min=0, max=1, help="Only pairs of which one image shares at least this with the other."),
    ] = None,
) -> None:
    """Say how much each pair of robots sees in common, and how that is known."""
    with MissionControl(url, token) as control:
        _show(control.pairs(robot, min_overlap), tables.pairs, output)


def similarity(url: Url = DEFAULT_URL, token: Token = None, output: Output = Format.TABLE) -> None:
    """Say how similar all robots are, which is what they are grouped by."""
    with MissionControl(url, token) as control:
        _show(control.similarity(), tables.similarity, output)


def groups(url: Url = DEFAULT_URL, token: Token = None, output: Output = Format.TABLE) -> None:
    """Say which robots belong together."""
    with MissionControl(url, token) as control:
        _show(control.groups(), tables.groups, output)


def _show(report: _R, table: Callable[[_R], RenderableType], output: Format) -> None:
    if output is Format.JSON:
        print(report.model_dump_json(indent=2))
    else:
        Console().print(table(report))
