"""The settings that can change while a station runs: shown, tried and changed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from covista_schemas.errors import CovistaError
from rich.console import Console

from covista_clients.commands import tables
from covista_clients.commands.options import DEFAULT_URL, Authorities, Format, Output, Token, Url, station
from covista_clients.commands.showing import show

settings = typer.Typer(invoke_without_command=True)

OwnUrl = Annotated[str | None, typer.Option("--url", help="As of `covista settings`.")]
OwnToken = Annotated[str | None, typer.Option("--token", help="As of `covista settings`.")]
OwnAuthorities = Annotated[Path | None, typer.Option("--ca", metavar="FILE", help="As of `covista settings`.")]
OwnOutput = Annotated[Format | None, typer.Option("--format", help="As of `covista settings`.")]


def preview(
    alpha: Annotated[float | None, typer.Option(help="Weight of the overlap against closeness.")] = None,
    groups: Annotated[str | None, typer.Option(help='auto, a number, or {"min": 2, "max": 4}.')] = None,
    min_group_size: Annotated[int | None, typer.Option(help="How many robots a group has at least.")] = None,
    sigma: Annotated[str | None, typer.Option(help="Range of closeness: shared, std, or metres.")] = None,
    criterion: Annotated[str | None, typer.Option(help="How the number of groups is chosen.")] = None,
    grouping: Annotated[str | None, typer.Option(help="What groups are made from.")] = None,
    url: Url = DEFAULT_URL,
    token: Token = None,
    ca: Authorities = None,
    output: Output = Format.TABLE,
) -> None:
    """Say which groups there would be with other settings, beside those in force; changes nothing."""
    asked: dict[str, Any] = {
        "alpha": alpha,
        "groups": None if groups is None else _value(groups),
        "min_group_size": min_group_size,
        "sigma": None if sigma is None else _value(sigma),
        "criterion": criterion,
        "grouping": grouping,
    }
    with station(url, token, ca) as control:
        tried = control.preview({name: value for name, value in asked.items() if value is not None})
        if output is Format.JSON:
            print(tried.model_dump_json(indent=2))
        else:
            Console().print(tables.beside(control.groups(), tried))


@settings.callback()
def show_settings(
    context: typer.Context,
    url: Url = DEFAULT_URL,
    token: Token = None,
    ca: Authorities = None,
    output: Output = Format.TABLE,
) -> None:
    """Say which of the settings that can change while the station runs are in force, or `set` them."""
    context.obj = url, token, ca, output
    if context.invoked_subcommand is None:
        with station(url, token, ca) as control:
            show(control.settings(), tables.settings, output)


@settings.command("set")
def set_settings(
    context: typer.Context,
    changes: Annotated[list[str], typer.Argument(metavar="NAME=VALUE...", help="As in alpha=0.7 hysteresis.gain=0.1.")],
    url: OwnUrl = None,
    token: OwnToken = None,
    ca: OwnAuthorities = None,
    output: OwnOutput = None,
) -> None:
    """Change settings, at once and for good; the others stay. A value is JSON, or a word."""
    before_url, before_token, before_ca, before_output = context.obj
    patch = parse_changes(changes)
    with station(url or before_url, token or before_token, ca or before_ca) as control:
        show(control.patch_settings(patch), tables.settings, output or before_output)


def parse_changes(changes: list[str]) -> dict[str, Any]:
    """`hysteresis.gain=0.1` as {"hysteresis": {"gain": 0.1}}. Raises CovistaError for what is none, or given twice."""
    patch: dict[str, Any] = {}
    for change in changes:
        path, equals, text = change.partition("=")
        names = path.split(".")
        if not equals or not all(names):
            raise CovistaError(f"{change!r} is not a change such as alpha=0.7")
        inner = patch
        for name in names[:-1]:
            inner = inner.setdefault(name, {})
            if not isinstance(inner, dict):
                raise CovistaError(f"{name} is given twice, whole and in parts")
        if names[-1] in inner:
            raise CovistaError(f"{path} is given twice")
        inner[names[-1]] = _value(text)
    return patch


def _value(text: str) -> Any:
    """JSON where it is that, else the word itself."""
    try:
        return json.loads(text, parse_constant=str)
    except ValueError:
        return text
