"""Groups live over zenoh."""

from __future__ import annotations

import queue
import sys
import threading

import zenoh
from covista_schemas import keys
from covista_schemas.errors import LinkError
from covista_schemas.reports import GroupsReport
from covista_schemas.zenoh_config import check_endpoint
from pydantic import ValidationError

from covista_clients.commands import tables
from covista_clients.commands.interrupting import ends_by_interrupt
from covista_clients.commands.options import DEFAULT_CONNECT, Connect, Format, Output, Site
from covista_clients.rover.link import follow, open_with_retry


def watch(connect: Connect = DEFAULT_CONNECT, site: Site = "default", output: Output = Format.TABLE) -> None:
    """Print the groups, and again whenever they change, until Ctrl-C."""
    key = keys.groups(site)
    check_endpoint(connect)
    with ends_by_interrupt():
        print(f"Waiting for groups of site {site} by {connect}; Ctrl-C ends.", file=sys.stderr)
        session = open_with_retry(connect, threading.Event())
        if session is None:
            return
        with session:
            _print_all(session, key, output)


def _print_all(session: zenoh.Session, key: str, output: Format) -> None:
    arrived: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    subscriber = follow(session, key, lambda sample: arrived.put(sample.payload.to_bytes()))
    with subscriber:
        while True:
            _print_one(arrived.get(), output)


def _print_one(data: bytes, output: Format) -> None:
    try:
        report = GroupsReport.read(data)
    except ValidationError as error:
        raise LinkError(f"what came is not the groups of a station: {error.error_count()} errors") from error
    print(report.model_dump_json() if output is Format.JSON else tables.groups_line(report), flush=True)
