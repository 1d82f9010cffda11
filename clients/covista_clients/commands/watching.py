"""Groups live over zenoh."""

from __future__ import annotations

import queue
import sys
import threading

import zenoh
from covista_schemas import keys
from covista_schemas.errors import LinkError
from covista_schemas.reports import GroupsReport
from pydantic import ValidationError

from covista_clients.commands import tables
from covista_clients.commands.interrupting import ends_by_interrupt
from covista_clients.commands.options import (
    DEFAULT_CONNECT,
    Connect,
    Format,
    Output,
    Site,
    TlsCa,
    TlsCert,
    TlsKey,
    certificates,
)
from covista_clients.rover.link import PATIENCE_S, follow, open_with_retry


def watch(
    connect: Connect = DEFAULT_CONNECT,
    tls_ca: TlsCa = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    site: Site = "default",
    output: Output = Format.TABLE,
) -> None:
    """Print the groups, and again whenever they change, until Ctrl-C."""
    key = keys.groups(site)
    tls = certificates(connect, tls_ca, tls_cert, tls_key)
    name = tls.common_name() if tls else None
    with ends_by_interrupt():
        print(f"Waiting for groups of site {site} by {connect}; Ctrl-C ends.", file=sys.stderr)
        session = open_with_retry(connect, threading.Event(), tls)
        if session is None:
            return
        with session:
            _print_all(session, key, output, name)


def _print_all(session: zenoh.Session, key: str, output: Format, name: str | None) -> None:
    arrived: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    subscriber = follow(session, key, lambda sample: arrived.put(sample.payload.to_bytes()))
    with subscriber:
        if name is not None:
            _wonder(arrived, name, output)
        while True:
            _print_one(arrived.get(), output)


def _wonder(arrived: queue.SimpleQueue[bytes], name: str, output: Format) -> None:
    """Zenoh does not tell whom it hides the groups from."""
    try:
        _print_one(arrived.get(timeout=PATIENCE_S), output)
    except queue.Empty:
        print(
            f"No groups yet: is there a station behind the router, and is {name} in its list of robots?",
            file=sys.stderr,
        )


def _print_one(data: bytes, output: Format) -> None:
    try:
        report = GroupsReport.read(data)
    except ValidationError as error:
        raise LinkError(f"what came is not the groups of a station: {error.error_count()} errors") from error
    print(report.model_dump_json() if output is Format.JSON else tables.groups_line(report), flush=True)
