"""What pages and strangers can make the station hold: so much and no more, and nothing for good."""

from __future__ import annotations

import base64
import os
import re
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from urllib.parse import urlsplit

import httpx
import psutil
import pytest

from tests.browser.conftest import LockedStation
from tests.browser.stations import BrowsedStation
from tests.service.deadline import wait_until

pytest.importorskip("nicegui")

MB = 1024 * 1024
MOST_PAGES, MOST_SOCKETS = 256, 512
STALLED = 60
# Of a page, with its socket and all that was asked and never read.
PAGE_MB, STALLED_MB = 0.25, 0.5
STRANGE = (
    "/dashboard/nothing",
    "/dashboard/files/nothing.js",
    "/dashboard/_nicegui/nothing",
    "/dashboard/_nicegui/client",
    "/dashboard/_nicegui_ws/socket.io/?EIO=4&transport=polling",
    "/dashboard/log-in",
)


def held_mb(station: BrowsedStation) -> float:
    return psutil.Process(station.pid).memory_info().rss / MB


@contextmanager
def somebody(locked: LockedStation) -> Iterator[httpx.Client]:
    """A client that has logged in."""
    with locked.station.client() as client:
        assert client.post("/dashboard/session", data={"token": locked.reader}).status_code == 303
        yield client


def upgrade(locked: LockedStation, client: httpx.Client, path: str, **headers: str) -> socket.socket:
    """A websocket as a browser opens it, of which nothing has been read but that it is open, or not."""
    where = urlsplit(locked.station.url)
    lines = {
        "Host": where.netloc,
        "Origin": locked.station.url,
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(),
        "Cookie": "; ".join(f"{name}={value}" for name, value in client.cookies.items()),
    } | headers
    opened = socket.create_connection((where.hostname or "", where.port or 80), timeout=20)
    request = "".join(f"{name}: {value}\r\n" for name, value in lines.items())
    opened.sendall(f"GET {path} HTTP/1.1\r\n{request}\r\n".encode())
    return opened


def status_of(opened: socket.socket) -> int:
    return int(opened.recv(12).split(b" ")[1])


def socket_path(page: str) -> str:
    """Where the socket of a page is, as its script asks for it."""
    found = re.search(r"'client_id': '([\w-]+)'", page)
    assert found
    query = f"EIO=4&transport=websocket&client_id={found[1]}&next_message_id=0&implicit_handshake=true"
    return f"/dashboard/_nicegui_ws/socket.io/?{query}&tab_id={found[1]}&document_id={found[1]}"


def test_strangers_leave_nothing_behind(locked: LockedStation) -> None:
    with locked.station.client() as stranger, somebody(locked) as client:
        client.get("/dashboard/")
        before_mb = held_mb(locked.station)
        statuses = {path: {stranger.get(path).status_code for _ in range(MOST_PAGES)} for path in STRANGE}
        assert list(statuses.values()) == [{303}, {404}, {404}, {404}, {401}, {200}]
        # Had each left a page, none more would open.
        assert client.get("/dashboard/").status_code == 200
        assert held_mb(locked.station) - before_mb < 20


def test_no_stranger_opens_a_socket_and_nobody_talks_to_its_place_without_one(locked: LockedStation) -> None:
    with somebody(locked) as client, locked.station.client() as stranger:
        path = socket_path(client.get("/dashboard/").text)
        for headers in ({"Cookie": ""}, {"Origin": "http://elsewhere"}, {"Host": "elsewhere"}):
            with upgrade(locked, client, path, **headers) as refused:
                assert status_of(refused) == 403
        assert stranger.get(path.replace("websocket", "polling")).status_code == 401
        assert client.get(path.replace("websocket", "polling")).status_code == 404
        assert client.post(path.replace("websocket", "polling"), content="40").status_code == 404
        with upgrade(locked, client, path) as opened:
            assert status_of(opened) == 101


def test_pages_that_never_read_cost_little_and_are_forgotten(locked: LockedStation) -> None:
    asked = b"GET /dashboard/data/swarm HTTP/1.1\r\nHost: %b\r\nCookie: %b\r\n\r\n"
    with somebody(locked) as client, ExitStack() as stack:
        client.get("/dashboard/")
        before_mb = held_mb(locked.station)
        sockets = []
        for _ in range(STALLED):
            path = socket_path(client.get("/dashboard/").text)
            sockets.append(stack.enter_context(upgrade(locked, client, path)))
            assert status_of(sockets[-1]) == 101
            plain = stack.enter_context(upgrade(locked, client, "/dashboard/data/swarm", Upgrade="", Connection=""))
            cookie = "; ".join(f"{name}={value}" for name, value in client.cookies.items())
            plain.settimeout(0.5)
            try:
                for _ in range(40):
                    plain.sendall(100 * (asked % (urlsplit(locked.station.url).netloc.encode(), cookie.encode())))
            except TimeoutError:
                pass
        cost_mb = (held_mb(locked.station) - before_mb) / STALLED
        assert cost_mb <= STALLED_MB, cost_mb
        for each in sockets:
            wait_until(lambda one=each: one.recv(65536) == b"", "the station gives the socket up", 60)
        assert client.get("/dashboard/").status_code == 200


def test_too_many_pages_are_refused_in_words_and_the_others_go_on(locked: LockedStation) -> None:
    with somebody(locked) as client:
        client.get("/dashboard/")
        before_mb = held_mb(locked.station)
        statuses = [client.get("/dashboard/").status_code for _ in range(MOST_PAGES + 10)]
        assert statuses[-10:] == [503] * 10
        assert set(statuses) == {200, 503}
        full = client.get("/dashboard/similarity")
        assert "Too many pages are open" in full.text
        assert int(full.headers["retry-after"]) > 0
        assert (held_mb(locked.station) - before_mb) / MOST_PAGES <= PAGE_MB
        # Pages that stand are served as before.
        assert client.get("/dashboard/data/swarm").status_code == 200
        assert client.get("/dashboard/files/covista.css").status_code == 200
        assert client.get("/api/v1/groups").status_code == 200
        # Pages that nobody looks at are given up.
        wait_until(lambda: client.get("/dashboard/health").status_code == 200, "there is room again", 100)
