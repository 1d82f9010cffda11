"""The door to pages with what stands behind it, but without NiceGUI: pages are a word each."""

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import dataclass
from typing import Any

import httpx
from covista_service.access import Attempts, Gate, Keyring, Scope
from covista_service.access.sessions import COOKIE
from covista_service.api import rest
from covista_service.dashboard import data, log_in
from covista_service.dashboard.places import PAGES
from covista_service.dashboard.sources import Sources
from fastapi import APIRouter, Request, WebSocket
from fastapi.responses import PlainTextResponse

from tests.service.access.sources import Shelf
from tests.service.api.conftest import Desk

HOST = "station"
# What browsers say of a request that a page of this station makes, and of one that a page of somebody else makes.
OWN = {"sec-fetch-site": "same-origin", "sec-fetch-mode": "cors"}
OTHERS = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "cors", "origin": "http://elsewhere"}
SOCKET = f"{PAGES.prefix}{PAGES.sockets}socket.io/"


@dataclass
class Front(Desk):
    """A desk with pages before it; with `shelf` it is locked, and `most` wrong tokens are heard out a minute."""

    shelf: Shelf | None = None
    most: int = 10_000

    def __post_init__(self) -> None:
        self.keyring = Keyring()
        self.keyring.take(self.shelf.read() if self.shelf else [])
        self.gate = Gate(self.keyring, Attempts(self.most))
        super().__post_init__()
        self.app = rest.build(pages=PAGES)
        routes = APIRouter(prefix=PAGES.prefix)
        routes.include_router(data.router)
        routes.include_router(log_in.router)
        routes.add_api_websocket_route(f"{PAGES.sockets}socket.io/", _echo)
        routes.add_api_route("/{path:path}", _page, methods=["GET", "POST"])
        self.app.include_router(routes)
        parts = self.parts
        self.sources = Sources(
            parts.name, parts.loop, parts.telemetry, parts.health, parts.vitals, self.gate, self.archive
        )

    async def _stateful(self, scope: dict[str, Any], receive: Any, send: Any) -> None:
        scope["state"] = {"parts": self.parts, "dashboard": self.sources}
        await self.app(scope, receive, send)

    def page(self, path: str, session: str = "", method: str = "GET", **headers: str) -> httpx.Response:
        """Ask for something below the prefix, as a browser with this session would."""
        shown = {"cookie": f"other=1; {COOKIE}={session}"} if session else {}
        return self.ask(f"{PAGES.prefix}{path}", method, **(shown | headers))

    def log_in(self, token: str, back: str = "/", **headers: str) -> httpx.Response:
        """Send the form."""
        form = str(httpx.QueryParams({"token": token, "next": back}))
        sent = {"content-type": "application/x-www-form-urlencoded", **headers}
        return self.ask(f"{PAGES.prefix}/session", "POST", form, **sent)

    def revoke(self, name: str) -> None:
        """Revoke a token; the station has heard of it."""
        assert self.shelf
        self.shelf.revoke(name)
        self.keyring.take(self.shelf.read())

    def talk(self, *said: dict[str, Any] | Any, path: str = SOCKET, **headers: str) -> list[dict[str, Any]]:
        """Open a websocket, say this, and hear what comes; what can be called is done in its turn."""
        shown = {"host": HOST, **headers}
        scope = {
            "type": "websocket",
            "asgi": {"version": "3.0"},
            "scheme": "ws",
            "path": path,
            "raw_path": path.encode(),
            "query_string": b"",
            "root_path": "",
            "client": ("127.0.0.1", 1),
            "server": (HOST, 80),
            "subprotocols": [],
            "headers": [(name.encode(), value.encode()) for name, value in shown.items()],
        }
        turns, heard = deque([{"type": "websocket.connect"}, *said]), []

        async def receive() -> dict[str, Any]:
            while turns and callable(turns[0]):
                turns.popleft()()
            return turns.popleft() if turns else {"type": "websocket.disconnect", "code": 1000}

        async def send(message: dict[str, Any]) -> None:
            heard.append(message)

        asyncio.run(self._stateful(scope, receive, send))
        return heard


def says(text: str) -> dict[str, Any]:
    """What is said over a websocket."""
    return {"type": "websocket.receive", "text": text}


def locked() -> tuple[Front, str, str]:
    """A front that asks for tokens; one that may read, named reader, and one that may operate."""
    shelf = Shelf()
    reader, operator = shelf.add("reader", Scope.READ), shelf.add("operator", Scope.OPERATE)
    return Front(shelf=shelf), reader, operator


async def _echo(socket: WebSocket) -> None:
    await socket.accept()
    async for text in socket.iter_text():
        await socket.send_text(text)


async def _page(request: Request) -> PlainTextResponse:
    return PlainTextResponse("a page")
