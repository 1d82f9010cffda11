"""Options that several commands share."""

from __future__ import annotations

from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from covista_schemas.errors import LinkError
from covista_schemas.zenoh_config import check_endpoint, check_transport
from covista_schemas.zenoh_tls import Tls

from covista_clients.mission_control import MissionControl


class Format(StrEnum):
    """A table for people, JSON for programs."""

    TABLE = "table"
    JSON = "json"


def _moment(text: str) -> datetime:
    """A time as in reports; without a zone it is UTC."""
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a time such as 2026-05-04T03:02:01Z") from None
    return time if time.tzinfo else time.replace(tzinfo=UTC)


Url = Annotated[str, typer.Option(envvar="COVISTA_URL", help="Address of the station's API.")]
Token = Annotated[
    str | None,
    typer.Option(
        envvar="COVISTA_TOKEN",
        show_envvar=True,
        help="Bearer token, where the station wants one. Given as an option, everybody on this machine can read it in "
        "the list of processes: use the variable.",
    ),
]
Authorities = Annotated[
    Path | None,
    typer.Option("--ca", envvar="COVISTA_CA", metavar="FILE", help="PEM file of the authorities to trust under https."),
]
Output = Annotated[Format, typer.Option("--format", help="A table for people, or the report as JSON for programs.")]
Lines = Annotated[Format, typer.Option("--format", help="Lines for people, or a line of JSON per event for programs.")]
Since = Annotated[
    datetime | None,
    typer.Option(
        "--from",
        parser=_moment,
        metavar="TIME",
        help="The earliest time, such as 2026-05-04T03:02:01Z. [the oldest there is]",
    ),
]
Until = Annotated[datetime | None, typer.Option("--to", parser=_moment, metavar="TIME", help="The latest time. [now]")]
Cursor = Annotated[
    str | None,
    typer.Option(metavar="NEXT", help="Where an earlier answer ended: its `next`. The other options as then."),
]
Limit = Annotated[int, typer.Option(min=1, help="At most so many entries.")]
Connect = Annotated[
    str, typer.Option(metavar="ENDPOINT", help="End point of the station's zenoh link, or of a router.")
]
TlsCa = Annotated[
    Path | None,
    typer.Option(envvar="COVISTA_ZENOH_TLS_CA", metavar="FILE", help="PEM file with the certificates' authority."),
]
TlsCert = Annotated[
    Path | None,
    typer.Option(envvar="COVISTA_ZENOH_TLS_CERT", metavar="FILE", help="PEM file with the certificate of the robot."),
]
TlsKey = Annotated[
    Path | None, typer.Option(envvar="COVISTA_ZENOH_TLS_KEY", metavar="FILE", help="PEM file with its key.")
]
Site = Annotated[str, typer.Option(help="Site that the station looks after.")]

DEFAULT_URL = "http://127.0.0.1:8000"
DEFAULT_CONNECT = "tcp/127.0.0.1:7447"


def certificates(connect: str, ca: Path | None, cert: Path | None, key: Path | None) -> Tls | None:
    """The files that the options name, all or none, for an end point that wants them or does not. Raises LinkError."""
    given = {"--tls-ca": ca, "--tls-cert": cert, "--tls-key": key}
    absent = [name for name, file in given.items() if file is None]
    if 0 < len(absent) < len(given):
        raise LinkError(f"{', '.join(name for name in given if name not in absent)} needs {', '.join(absent)}")
    check_endpoint(connect)
    try:
        check_transport(connect, not absent)
    except LinkError as error:
        raise LinkError(f"--connect: {error} (--tls-ca, --tls-cert, --tls-key)") from error
    return Tls(ca, cert, key) if ca and cert and key else None


def station(url: str, token: str | None, authorities: Path | None) -> MissionControl:
    """The station that the options name."""
    return MissionControl(url, token, verify=authorities or True)
