"""Answers on the terminal."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from covista_schemas.reports import Report
from rich.console import Console, RenderableType

from covista_clients.commands.options import Format

_R = TypeVar("_R", bound=Report)


def show(report: _R, table: Callable[[_R], RenderableType], output: Format) -> None:
    """Print a report as a table, or as JSON alone."""
    if output is Format.JSON:
        print(report.model_dump_json(indent=2))
    else:
        Console().print(table(report))
