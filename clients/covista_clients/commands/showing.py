"""Answers on the terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TypeVar

from covista_schemas.reports import Report
from rich.console import Console, RenderableType

from covista_clients.commands.options import Format
from covista_clients.mission_control import MissionControl

_R = TypeVar("_R", bound=Report)


def show(report: _R, table: Callable[[_R], RenderableType], output: Format) -> None:
    """Print a report as a table, or as JSON alone."""
    if output is Format.JSON:
        print(report.model_dump_json(indent=2))
    else:
        Console().print(table(report))


def tell_if_starting(control: MissionControl) -> None:
    """Say on stderr that the station is starting if it is: it knows nobody yet, whoever there is."""
    health = control.ready()
    if health.status == "starting":
        parts = (
            f"{name}: {part.detail or part.status}" for name, part in health.parts.items() if part.status == "starting"
        )
        print(f"The station is still starting ({'; '.join(parts)}).", file=sys.stderr)
