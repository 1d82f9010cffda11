"""`covista-station router`: a zenoh router as a process of its own, between robots and their station.

What it needs of the station is imported when the command runs: the command line must start without the extra too.
"""

from __future__ import annotations

import signal
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from covista_schemas.errors import CovistaError

if TYPE_CHECKING:
    from covista_service.config import Settings
    from covista_service.link.switchboard import Switchboard

EXIT_REFUSED = 1
EXIT_SETTINGS = 2
# Stations whose certificates do all, unless others are named.
DEFAULT_PEERS = ("station",)

Ca = Annotated[Path | None, typer.Option(metavar="FILE", help="The authority of all certificates on zenoh, as PEM.")]
Cert = Annotated[Path | None, typer.Option(metavar="FILE", help="The certificate that is shown on zenoh, as PEM.")]
Key = Annotated[Path | None, typer.Option(metavar="FILE", help="Its key, as PEM.")]
Robots = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Ids of the robots that are let in on zenoh, one a line.")
]


def router(
    listen: Annotated[
        list[str] | None,
        typer.Option(metavar="ENDPOINT", help="zenoh end point to listen on; repeatable. [tcp/127.0.0.1:7447]"),
    ] = None,
    connect: Annotated[
        list[str] | None, typer.Option(metavar="ENDPOINT", help="zenoh router to join; repeatable.")
    ] = None,
    peer: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Common name of a station's certificate; repeatable. [station]"),
    ] = None,
    site: Annotated[str | None, typer.Option(metavar="SITE", help="Site of the robots. [default]")] = None,
    insecure: Annotated[
        bool | None, typer.Option("--insecure", help="Listen beyond loopback without certificates.")
    ] = None,
    config: Annotated[Path | None, typer.Option(metavar="FILE", help="Settings, as TOML.")] = None,
    zenoh_tls_ca: Ca = None,
    zenoh_tls_cert: Cert = None,
    zenoh_tls_key: Key = None,
    zenoh_tls_robots: Robots = None,
) -> None:
    """Run a zenoh router until a signal comes. The settings are those of the station: link is where it listens."""
    from covista_service.config import SettingsError, load
    from covista_service.telemetry import log_to_stderr

    given = {
        "link": listen or None,
        "connect": connect or None,
        "zenoh_tls_peers": peer or None,
        "site": site,
        "insecure": insecure,
        "zenoh_tls_ca": zenoh_tls_ca,
        "zenoh_tls_cert": zenoh_tls_cert,
        "zenoh_tls_key": zenoh_tls_key,
        "zenoh_tls_robots": zenoh_tls_robots,
    }
    try:
        settings = load({name: value for name, value in given.items() if value is not None}, config)
    except SettingsError as error:
        _refuse(_own_words(error), EXIT_SETTINGS)
    log_to_stderr(settings.log_level, settings.log_format, settings.log_lines_per_minute)
    try:
        _run(settings)
    except CovistaError as error:
        _refuse(_own_words(error), EXIT_REFUSED)


def _run(settings: Settings) -> None:
    """Listen, say so, and wait to be told to stop; SIGHUP has the list of robots read. Raises LinkError."""
    from covista_service.config import without_options

    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    switchboard = open_router(settings)
    try:
        if settings.zenoh_tls is not None:
            signal.signal(signal.SIGHUP, lambda *_: switchboard.renew())
        places = " and joins ".join(
            ", ".join(without_options(each)) for each in (settings.link, settings.connect) if each
        )
        typer.echo(f"zenoh router on {places}")
        stop.wait()
    finally:
        switchboard.close()


def open_router(settings: Settings) -> Switchboard:
    """A router that listens. Raises AccessError where it would be open to the network, and LinkError."""
    from covista_service.access import check_listening
    from covista_service.link.admission import Lock
    from covista_service.link.alive import Alive
    from covista_service.link.switchboard import Switchboard, opening
    from covista_service.link.zenoh_log import follow_zenoh_log

    # It has no REST interface to be open.
    check_listening("localhost", settings.link, insecure=settings.insecure)
    lock, alive = None, Alive(settings.site)
    if settings.zenoh_tls is not None:
        follow_zenoh_log()
        lock = Lock(settings.zenoh_tls, settings.zenoh_tls_robots, settings.zenoh_tls_peers or DEFAULT_PEERS)
    open_for = opening(settings.link, settings.connect, settings.site, lock)
    switchboard = Switchboard(open_for, lock, waits=not settings.link, alive=alive.robots)
    if lock is not None:
        try:
            switchboard.plug(alive.join)
        except BaseException:
            switchboard.close()
            raise
    return switchboard


def _own_words(error: CovistaError) -> str:
    """Where the station links, a router listens."""
    return str(error).replace("--link", "--listen")


def _refuse(line: str, status: int) -> NoReturn:
    typer.echo(line, err=True)
    raise typer.Exit(status)
