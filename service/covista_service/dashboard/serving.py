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
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from covista_service.dashboard import pages
from covista_service.dashboard.places import FILES, PREFIX

WEB = Path(__file__).parent / "web"
# Pages that are open at a time: each holds some memory.
MOST_PAGES = 256
# A browser that was cut off has so long to come back to its page as it was.
_RECONNECT_S = 10.0
# Everything from the station itself. The framework puts its templates together in the browser.
_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; object-src 'none'; frame-ancestors 'none'; "
    "base-uri 'self'; form-action 'self'"
)

_FILES = tuple(f"{PREFIX}{each}" for each in FILES)
_FULL = PlainTextResponse("Too many pages are open; close some, or try again in a minute", 503, {"retry-after": "60"})


@cache
def _host() -> FastAPI:
    """Carries NiceGUI's own start and end, once a process: NiceGUI has no more than one application."""
    pages.register()
    pages_app.mount("/files", StaticFiles(directory=WEB))
    host = FastAPI()
    ui.run_with(
        host,
        title="Covista",
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
    # Its log says what our own has, and addresses with it.
    logging.getLogger("nicegui").setLevel(logging.ERROR)
    return host


def application() -> ASGIApp:
    """The pages, for what comes below their prefix."""
    _host()
    return _with_policy(pages_app)


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
                MutableHeaders(scope=message).setdefault("content-security-policy", _POLICY)
            await send(message)

        served = _FULL if _is_full(scope["path"]) else app
        await served(scope, receive, sending)

    return answer


def _is_full(path: str) -> bool:
    """Whether a page is asked for and too many are open."""
    return len(Client.instances) >= MOST_PAGES and not path.startswith(_FILES)
