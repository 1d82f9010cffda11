"""Options that several commands share."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer


class Format(StrEnum):
    """A table for people, JSON for programs."""

    TABLE = "table"
    JSON = "json"


Url = Annotated[str, typer.Option(envvar="COVISTA_URL", help="Address of the station's API.")]
Token = Annotated[str | None, typer.Option(envvar="COVISTA_TOKEN", help="Bearer token, where the station wants one.")]
Output = Annotated[Format, typer.Option("--format", help="A table for people, or the report as JSON for programs.")]
Connect = Annotated[
    str, typer.Option(metavar="ENDPOINT", help="End point of the station's zenoh link, or of a router.")
]
Site = Annotated[str, typer.Option(help="Site that the station looks after.")]

DEFAULT_URL = "http://127.0.0.1:8000"
DEFAULT_CONNECT = "tcp/127.0.0.1:7447"
