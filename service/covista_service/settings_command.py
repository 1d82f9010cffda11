"""`covista-station settings`: every setting there is, as a table; docs/operations.md has what it writes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import typer

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo


class Setting(NamedTuple):
    """One setting, in words."""

    name: str
    variable: str
    flag: str
    allowed: str
    default: str
    description: str


def settings(
    format: Annotated[Literal["markdown", "json"], typer.Option(help="What to write to stdout.")] = "markdown",  # noqa: A002 - the flag's name
) -> None:
    """List all settings: the key of the TOML file, the variable, the flag of `serve`, what is allowed, the default."""
    listed = list(every())
    if format == "json":
        typer.echo(json.dumps([each._asdict() for each in listed], indent=2))
    else:
        typer.echo("\n".join(markdown(listed)))


def every() -> Iterator[Setting]:
    """All settings, those that can be changed while the station runs last."""
    from covista_schemas.reports import Hysteresis, LiveSettings

    from covista_service.config import FLAGS, PREFIX, Settings, flag_of

    schema = Settings.model_json_schema()
    live = list(LiveSettings.model_fields)
    names = [name for name in Settings.model_fields if name not in live] + live
    for name in names:
        field, said = Settings.model_fields[name], schema["properties"][name]
        if field.annotation is Hysteresis:
            parts = schema["$defs"]["Hysteresis"]["properties"]
            for part, inner in Hysteresis.model_fields.items():
                yield _setting(f"{name}.{part}", f"{PREFIX}{name}__{part}".upper(), "", parts[part], inner)
            continue
        yield _setting(name, PREFIX + name.upper(), flag_of(name) if name in FLAGS else "", said, field)


def markdown(listed: list[Setting]) -> Iterator[str]:
    """A table, a line each."""
    yield "| setting | variable | flag | allowed | default | what it is |"
    yield "|---|---|---|---|---|---|"
    for each in listed:
        cells = [f"`{each.name}`", f"`{each.variable}`", f"`{each.flag}`" if each.flag else ""]
        cells += [each.allowed, f"`{each.default}`" if each.default else "", each.description]
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _setting(name: str, variable: str, flag: str, said: dict[str, Any], field: FieldInfo) -> Setting:
    return Setting(name, variable, flag, _allowed(said), _default(field.default), field.description or "")


def _default(value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value is None else str(value)


def _allowed(said: dict[str, Any]) -> str:
    """What a schema allows, in words."""
    if "anyOf" in said:
        return " or ".join(filter(None, (_allowed(each) for each in said["anyOf"])))
    if "$ref" in said:
        return "{min, max}" if said["$ref"].endswith("GroupBounds") else said["$ref"].rpartition("/")[2]
    for key in ("enum", "const"):
        if key in said:
            return ", ".join(said[key]) if isinstance(said[key], list) else str(said[key])
    kind = {"number": "number", "integer": "whole number", "boolean": "true, false", "array": "list"}
    return " ".join(
        filter(None, (kind.get(said.get("type", ""), "text" if said.get("type") == "string" else ""), _range(said)))
    )


def _range(said: dict[str, Any]) -> str:
    words = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    return ", ".join(f"{sign} {said[key]:g}" for key, sign in words.items() if key in said)
