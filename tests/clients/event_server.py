"""A station that tells events by server-sent events, as a script says, over real sockets."""

from __future__ import annotations

import ssl
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from covista_schemas.reports import EventReport, Problem

Tell = Callable[["Teller"], None]
DEADLINE_S = 10.0


def event(report: EventReport) -> bytes:
    """One event as it crosses the wire."""
    return f"id: {report.id}\nevent: {report.event}\ndata: {report.model_dump_json()}\n\n".encode()


def cut(problem: Problem) -> bytes:
    """What a reader that is too slow hears at the end."""
    return f"event: cut\ndata: {problem.model_dump_json()}\n\n".encode()


class Teller(BaseHTTPRequestHandler):
    """One connection."""

    protocol_version = "HTTP/1.1"
    server: EventServer

    def do_GET(self) -> None:
        server = self.server
        with server.changed:
            tell = server.script[min(len(server.asked), len(server.script) - 1)]
            server.asked.append(self.headers.get("Last-Event-ID"))
            server.changed.notify_all()
        self.close_connection = True
        tell(self)

    def begin(self, content_type: str = "text/event-stream") -> None:
        """Headers of an answer that goes on until the connection ends."""
        self.send_response(200)
        self.send_header("Content-Type", content_type)
        self.send_header("Connection", "close")
        self.end_headers()

    def say(self, *parts: bytes) -> None:
        """Send at once."""
        for part in parts:
            self.wfile.write(part)
            self.wfile.flush()

    def refuse(self, status: int, headers: dict[str, str] | None = None) -> None:
        """Answer with a problem."""
        content = Problem(title="Not now", status=status).model_dump_json().encode()
        self.send_response(status)
        for name, value in ({"Content-Length": str(len(content))} | (headers or {})).items():
            self.send_header(name, value)
        self.end_headers()
        self.say(content)

    def stay(self) -> None:
        """Say nothing until the server ends."""
        self.server.ending.wait(DEADLINE_S)

    def log_message(self, *arguments: object) -> None:
        """Silence."""


class EventServer(ThreadingHTTPServer):
    """Each connection is told by the next part of the script, the last by all that follow."""

    def __init__(self, script: Sequence[Tell]) -> None:
        super().__init__(("127.0.0.1", 0), Teller)
        self.script = script
        self.asked: list[str | None] = []
        self.changed = threading.Condition()
        self.ending = threading.Event()

    @property
    def url(self) -> str:
        """Where it is."""
        return f"http://127.0.0.1:{self.server_port}"

    def wait_for_connections(self, count: int) -> None:
        """Wait until so many were made."""
        with self.changed:
            assert self.changed.wait_for(lambda: len(self.asked) >= count, DEADLINE_S), self.asked


@contextmanager
def telling(*script: Tell, certificate: tuple[Path, Path] | None = None) -> Iterator[EventServer]:
    """A server in threads of its own, under TLS with a certificate and its key."""
    with EventServer(script) as server:
        if certificate is not None:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(*certificate)
            server.socket = context.wrap_socket(server.socket, server_side=True)
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield server
        finally:
            server.ending.set()
            server.shutdown()
            thread.join()
