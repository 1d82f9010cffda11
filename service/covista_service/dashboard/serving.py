"""NiceGUI's application, with our pages in it. Importing this imports NiceGUI."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache
from pathlib import Path

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles
from nicegui import app as pages_app
from nicegui import core, ui
from nicegui.client import Client
from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from covista_service.dashboard import pages
from covista_service.dashboard.places import FILES, MOST_PAGES, PAGES, PREFIX, REFERRER
from covista_service.dashboard.sockets import bounded_sockets

WEB = Path(__file__).parent / "web"
# A browser that was cut off has so long to come back to its page as it was.
_RECONNECT_S = 10.0
# Everything from the station itself. The framework puts its templates together in the browser.
_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; object-src 'none'; frame-ancestors 'none'; "
    "base-uri 'self'; form-action 'self'"
)

_FILES = tuple(f"{PREFIX}{each}" for each in FILES)
_FULL_WORDS = "Too many pages are open; close some, or try again in a minute"
# Events of sockets that no page of ours has: all that they do, they do in the browser.
_UNUSED = ("event", "javascript_response", "log")
_NONE = PlainTextResponse("There is no such page", 404)
_FULL = PlainTextResponse(_FULL_WORDS, 503, {"retry-after": "60"})


@cache
def _host() -> FastAPI:
    """Carries NiceGUI's own start and end, once a process: NiceGUI has no more than one application."""
    pages.register()
    pages_app.mount("/files", StaticFiles(directory=WEB))
    host = FastAPI()
    ui.run_with(
        host,
        title="Covista",
        favicon=(WEB / "icon.svg").read_text(),
        mount_path=PREFIX,
        dark=None,
        language="en-US",
        binding_refresh_interval=None,
        reconnect_timeout=_RECONNECT_S,
        message_history_length=50,
        tailwind=False,
        gzip_middleware_factory=None,
        show_welcome_message=False,
    )
    core.app.config.socket_io_js_transports = ["websocket"]
    for each in _UNUSED:
        core.sio.handlers["/"].pop(each, None)
    # The framework makes a page for it, and keeps that for a minute.
    pages_app.exception_handlers[404] = _nothing_there
    # Its log says what our own has, and addresses with it.
    logging.getLogger("nicegui").setLevel(logging.ERROR)
    return host


def application() -> ASGIApp:
    """The pages, for what comes below their prefix."""
    _host()
    return _with_policy(bounded_sockets(pages_app))


def open_pages() -> int:
    """How many are open now."""
    return len(Client.instances)


async def _nothing_there(_request: Request, _error: Exception) -> Response:
    return _NONE


@asynccontextmanager
async def started() -> AsyncIterator[None]:
    """NiceGUI works meanwhile."""
    host = _host()
    async with host.router.lifespan_context(host):
        yield


def _with_policy(app: ASGIApp) -> ASGIApp:
    """Says to browsers what a page may load and do, and that there are too many pages."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await app(scope, receive, send)
            return

        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.setdefault("content-security-policy", _POLICY)
                headers.setdefault("referrer-policy", REFERRER)
            await send(message)

        await _served(scope, app)(scope, receive, sending)

    return answer


def _served(scope: Scope, app: ASGIApp) -> ASGIApp:
    """What answers: for who asks, without a websocket, where those are, nothing does, for it would be kept."""
    path = scope["path"]
    if path.startswith(f"{PREFIX}{PAGES.sockets}"):
        return _NONE
    # Whoever asks could write it, and pages would have it in all their addresses.
    scope["headers"] = [(name, value) for name, value in scope["headers"] if name != b"x-forwarded-prefix"]
    return _FULL if open_pages() >= MOST_PAGES and not path.startswith(_FILES) else app
