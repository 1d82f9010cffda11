"""Real sockets of clients that do not read, do not ask, or are too many."""

import asyncio
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, cast

import httpx
import pytest
import uvicorn
from covista_service.api import delivery
from covista_service.api.connection import Connection, Patience
from covista_service.api.outgoing import CHUNK_BYTES

from tests.service.answers.test_pieces import swarm
from tests.service.api.conftest import Desk
from tests.service.deadline import wait_until

ROBOTS = 300
ASK = b"GET %b HTTP/1.1\r\nhost: station\r\n\r\n"
RECEIVE_BYTES = 16_384
# More than what a socket takes in, unread.
LARGE_BYTES = 12_000_000


@dataclass(frozen=True)
class Site:
    """A station that knows many robots, on a port."""

    desk: Desk
    port: int
    server: uvicorn.Server

    def get(self, path: str) -> httpx.Response:
        return httpx.get(f"http://127.0.0.1:{self.port}{path}", timeout=10)

    def ask(self, path: bytes = b"/api/v1/similarity") -> socket.socket:
        """A client that asks and does not read."""
        client = socket.create_connection(("127.0.0.1", self.port))
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BYTES)
        client.sendall(ASK % path if path else b"GET /heal")
        return client

    @property
    def given_up(self) -> dict[str, int]:
        return dict(self.desk.parts.outgoing.given_up)

    def unsent(self) -> int:
        """Bytes in the buffers of all connections."""
        transports = [cast(Connection, each).transport for each in tuple(self.server.server_state.connections)]
        return sum(transport.get_write_buffer_size() for transport in transports)


def serve(desk: Desk, patience: Patience, stack: ExitStack) -> Site:
    """Serve in a thread of its own, as `serve.run` does."""

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await desk._stateful(scope, receive, send)

    made = partial(Connection, given_up=desk.parts.outgoing.given_up, patience=patience)
    config = uvicorn.Config(
        app,
        http=cast(type[asyncio.Protocol], made),
        lifespan="off",
        log_config=None,
        access_log=False,
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)
    listener = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
    thread = threading.Thread(target=lambda: asyncio.run(server.serve([listener])))
    thread.start()

    def stop() -> None:
        server.should_exit = True
        thread.join()

    stack.callback(stop)
    wait_until(lambda: server.started)
    return Site(desk, listener.getsockname()[1], server)


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as opened:
        yield opened


@pytest.fixture
def desk(monkeypatch: pytest.MonkeyPatch) -> Desk:
    desk = Desk()
    snapshot = replace(desk.scene.snapshot, similarity=swarm(ROBOTS, 0).similarity)
    monkeypatch.setattr(desk.parts.loop, "snapshot", lambda: snapshot)
    return desk


def test_clients_that_do_not_read_share_one_answer_and_the_others_are_served(desk: Desk, stack: ExitStack) -> None:
    site = serve(desk, Patience(look_s=60), stack)
    slow = [stack.enter_context(closing(site.ask())) for _ in range(40)]
    wait_until(lambda: site.unsent() > CHUNK_BYTES)
    whole = site.get("/api/v1/similarity")
    assert whole.json()["robots"] == [f"r{i}" for i in range(ROBOTS)]
    assert site.get("/api/v1/groups").status_code == 200
    assert desk.parts.outgoing.held_bytes == len(whole.content)
    assert site.unsent() <= len(slow) * 3 * CHUNK_BYTES
    assert site.given_up == {}


def test_who_does_not_read_is_cut_off_and_counted(desk: Desk, stack: ExitStack) -> None:
    site = serve(desk, Patience(look_s=0.2), stack)
    for _ in range(5):
        stack.enter_context(closing(site.ask()))
    wait_until(lambda: site.given_up == {"slow": 5}, "all cut off")
    wait_until(lambda: not desk.parts.outgoing.held_bytes and not site.server.server_state.connections)


def test_who_reads_slowly_is_not_cut_off_while_something_moves(desk: Desk, stack: ExitStack) -> None:
    site = serve(desk, Patience(look_s=0.3), stack)
    client = stack.enter_context(closing(site.ask()))
    pause, got, end_s = threading.Event(), 0, time.monotonic() + 1.5
    while time.monotonic() < end_s:
        part = client.recv(CHUNK_BYTES)
        assert part, "cut off"
        got += len(part)
        pause.wait(0.01)
    assert got < desk.parts.outgoing.held_bytes, "it was to read slowly"
    assert site.given_up == {}


def test_who_takes_too_long_over_one_answer_is_cut_off(
    desk: Desk, stack: ExitStack, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(delivery, "DELIVERY_S", 0.3)
    site = serve(desk, Patience(look_s=60), stack)
    stack.enter_context(closing(site.ask()))
    wait_until(lambda: site.given_up == {"slow": 1} and not site.server.server_state.connections)
    wait_until(lambda: not desk.parts.outgoing.held_bytes)
    assert not caplog.records


@pytest.mark.parametrize("path", [b"", b"/healthz"])
def test_who_asks_nothing_is_cut_off(desk: Desk, stack: ExitStack, path: bytes) -> None:
    """Half a request is none; and one that was answered gives no right to stay, even with half another."""
    site = serve(desk, Patience(look_s=0.2), stack)
    client = stack.enter_context(closing(site.ask(path)))
    if path:
        wait_until(lambda: client.recv(1000))
        client.sendall(b"GET /half HTTP/1.1\r\n")
    wait_until(lambda: site.given_up == {"silent": 1} and not site.server.server_state.connections)


def test_one_too_many_hears_so_and_health_is_told_all_the_same(desk: Desk, stack: ExitStack) -> None:
    site = serve(desk, Patience(look_s=60, connections=3), stack)
    for _ in range(3):
        stack.enter_context(closing(site.ask()))
    wait_until(lambda: len(site.server.server_state.connections) == 3)
    refused = site.get("/api/v1/groups")
    assert (refused.status_code, refused.headers["retry-after"]) == (503, "10")
    assert refused.headers["content-type"] == "application/problem+json"
    assert json.loads(refused.content)["title"] == "Too many connections"
    assert [site.get(path).status_code for path in ("/healthz", "/readyz", "/metrics")] == [200] * 3
    for _ in range(4):
        stack.enter_context(closing(site.ask()))
    wait_until(lambda: site.given_up["crowd"] >= 2)
    assert len(site.server.server_state.connections) <= 6


def test_an_answer_for_one_is_refused_where_too_much_is_under_way(desk: Desk, stack: ExitStack) -> None:
    site = serve(desk, Patience(look_s=60), stack)
    desk.parts.outgoing._most_bytes = 1000
    stack.enter_context(closing(site.ask()))
    wait_until(lambda: desk.parts.outgoing.held_bytes)

    async def large(scope: Any, receive: Any, send: Any) -> None:
        await delivery.deliver(bytes(LARGE_BYTES), desk.parts.outgoing, "text/plain")(scope, receive, send)

    desk.app.mount("/large", large)
    refused = site.get("/large/")
    assert refused.status_code == 503
    assert refused.json()["title"].startswith("Too many answers")
    assert site.given_up == {"busy": 1}
