"""`covista-station token`: makes, lists and revokes tokens, while the station runs or not.

What it needs of the station is imported when a command runs: the command line must start without the extra too.
"""

from __future__ import annotations

import json
import re
from contextlib import closing
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NoReturn

import typer
from covista_schemas.errors import CovistaError
from covista_schemas.keys import ID_PATTERN

if TYPE_CHECKING:
    from covista_service.access.tokens import Token

EXIT_REFUSED = 1
EXIT_SETTINGS = 2


class Allowed(StrEnum):
    """`access.Scope`, which needs the station's packages."""

    READ = "read"
    OPERATE = "operate"


token = typer.Typer(name="token", no_args_is_help=True, help="Tokens that let clients ask the REST interface.")

ConfigOption = Annotated[Path | None, typer.Option(metavar="FILE", help="Settings, as TOML.")]
DatabaseOption = Annotated[
    str | None, typer.Option(metavar="URL", help="Database of the station. [sqlite:///covista.db]")
]
NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="Who has it, such as control-1.")]


@token.command()
def add(
    name: NameArgument,
    scope: Annotated[
        list[Allowed] | None,
        typer.Option(help="What it allows; operate includes read; repeatable. [read]"),
    ] = None,
    config: ConfigOption = None,
    database: DatabaseOption = None,
) -> None:
    """Make a token and print it: it is shown this once and stored nowhere. A station that runs knows it at once."""
    from covista_service.access.scopes import Scope, written
    from covista_service.store.tokens import Tokens

    held = frozenset(map(Scope, scope or [Allowed.READ]))
    try:
        _check_name(name)
        where = _database(config, database)
        with closing(Tokens(where)) as tokens:
            secret = tokens.add(name, held)
    except CovistaError as error:
        _refuse(error)
    typer.echo(f"token {name} ({written(held)}) in {_shown(where)}; it is not shown again:", err=True)
    typer.echo(secret)


@token.command("list")
def list_tokens(
    config: ConfigOption = None,
    database: DatabaseOption = None,
    form: Annotated[Literal["table", "json"], typer.Option("--format")] = "table",
) -> None:
    """All tokens, revoked ones too; not the tokens themselves, which nobody knows but who has them."""
    from covista_service.store.tokens import Tokens

    try:
        where = _database(config, database)
        with closing(Tokens(where)) as tokens:
            rows = [_row(each) for each in tokens.read()]
    except CovistaError as error:
        _refuse(error)
    if form == "json":
        typer.echo(json.dumps(rows, indent=1))
        return
    if not rows:
        typer.echo(f"there are no tokens in {_shown(where)}", err=True)
        return
    titles = ("name", "scopes", "created", "last_used", "revoked")
    lines = [titles, *(tuple(row[title] or "-" for title in titles) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(titles))]
    for line in lines:
        typer.echo("  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)).rstrip())


@token.command()
def revoke(name: NameArgument, config: ConfigOption = None, database: DatabaseOption = None) -> None:
    """End a token. A station that runs lets nobody in with it after two seconds."""
    from covista_service.store.tokens import Tokens

    try:
        with closing(Tokens(_database(config, database))) as tokens:
            tokens.revoke(name)
    except CovistaError as error:
        _refuse(error)
    typer.echo(f"token {name} is revoked", err=True)


def _check_name(name: str) -> None:
    from covista_service.access.tokens import TokenError

    if not re.fullmatch(ID_PATTERN, name):
        raise TokenError(
            f"{name!r} is no name: small letters, digits, - and _, the first a letter or digit, at most 63"
        )


def _database(config: Path | None, database: str | None) -> str:
    """The database that `serve` would use with the same flags, environment and file."""
    from covista_service.config import load

    return load({} if database is None else {"database": database}, config).database


def _shown(database: str) -> str:
    """The database as it may be read over somebody's shoulder."""
    from sqlalchemy.engine import make_url

    return make_url(database).set(query={}).render_as_string(hide_password=True)


def _row(each: Token) -> dict[str, str | None]:
    from covista_service.access.scopes import written

    return {
        "name": each.name,
        "scopes": written(each.scopes),
        "created": _time(each.created_us),
        "last_used": _time(each.last_used_us),
        "revoked": _time(each.revoked_us),
    }


def _time(us: int | None) -> str | None:
    return None if us is None else datetime.fromtimestamp(us // 1_000_000, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def _refuse(error: CovistaError) -> NoReturn:
    from covista_service.config import SettingsError

    typer.echo(str(error), err=True)
    raise typer.Exit(EXIT_SETTINGS if isinstance(error, SettingsError) else EXIT_REFUSED)
