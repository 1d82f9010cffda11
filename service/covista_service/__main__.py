"""`covista-station`: the command line of the station. What computes is imported when its command runs."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer
from covista_schemas.errors import CovistaError, MissingExtraError

from covista_service.bench.command import bench
from covista_service.demo.command import demo
from covista_service.evaluation.calibration_command import calibrate
from covista_service.evaluation.command import evaluate
from covista_service.evaluation.paper.command import paper
from covista_service.evaluation.planted.command import planted
from covista_service.router_command import Ca, Cert, Key, Robots, router
from covista_service.settings_command import settings as list_settings
from covista_service.token_command import token

# The cores are shared out by the station's workers, and a picture's head may not claim what would not be decoded:
# BLAS and OpenCV read this when they are first imported.
for _name, _value in {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENCV_IO_MAX_IMAGE_PIXELS": "50000000",
}.items():
    os.environ.setdefault(_name, _value)

EXIT_REFUSED = 1
EXIT_SETTINGS = 2

application = typer.Typer(
    name="covista-station", no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False
)


@application.callback()
def _station() -> None:
    """Ground station for swarms of robots with cameras."""


@application.command()
def serve(
    config: Annotated[Path | None, typer.Option(metavar="FILE", help="Settings, as TOML.")] = None,
    api: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="Where REST listens. [127.0.0.1:8000]")] = None,
    link: Annotated[
        list[str] | None,
        typer.Option(metavar="ENDPOINT", help="zenoh end point to listen on; repeatable. [tcp/127.0.0.1:7447]"),
    ] = None,
    connect: Annotated[
        list[str] | None, typer.Option(metavar="ENDPOINT", help="zenoh router to join; repeatable.")
    ] = None,
    database: Annotated[str | None, typer.Option(metavar="URL", help="History. [sqlite:///covista.db]")] = None,
    workers: Annotated[
        str | None, typer.Option(metavar="threads|processes|dask://HOST:PORT", help="Where surveys run. [threads]")
    ] = None,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Listen beyond this machine without access control.")
    ] = False,
    zenoh_tls_ca: Ca = None,
    zenoh_tls_cert: Cert = None,
    zenoh_tls_key: Key = None,
    zenoh_tls_robots: Robots = None,
) -> None:
    """Run the station until a signal comes. Each flag is also a variable COVISTA_* and a key of the file."""
    given = dict(locals())
    from covista_service.config import FLAGS, SettingsError, load, without_options
    from covista_service.link.zenoh_log import follow_zenoh_log
    from covista_service.serve import Running, run
    from covista_service.telemetry import log_to_stderr

    flags = {name: value for name, value in given.items() if name in FLAGS and value not in (None, False, [])}
    try:
        settings = load(flags, config)
    except SettingsError as error:
        _refuse(str(error), EXIT_SETTINGS)
    log_to_stderr(settings.log_level, settings.log_format, settings.log_lines_per_minute)

    def tell(running: Running) -> None:
        zenoh = ", ".join(without_options(running.link or settings.connect))
        print(f"API {running.url}/api/v1, docs {running.url}/docs, zenoh {zenoh}", flush=True)

    if settings.zenoh_tls is not None:
        follow_zenoh_log()
    try:
        run(settings, ready=tell)
    except CovistaError as error:
        _refuse(str(error), EXIT_REFUSED)


def _refuse(line: str, status: int) -> None:
    print(line, file=sys.stderr)
    raise typer.Exit(status)


for _command in (router, demo, evaluate, calibrate, paper, planted, bench):
    application.command()(_command)
application.add_typer(token)
application.command("settings")(list_settings)


def main() -> None:
    """Run the command line; an absent optional package is one line that says what to install."""
    try:
        application()
    except MissingExtraError as error:
        print(error, file=sys.stderr)
        sys.exit(EXIT_REFUSED)
    except ImportError as error:
        package = (error.name or "").partition(".")[0]
        if package.startswith("covista") or not package:
            raise
        print(MissingExtraError(f"covista-station ({package} is not installed)", "station"), file=sys.stderr)
        sys.exit(EXIT_REFUSED)


if __name__ == "__main__":
    main()
