"""What every answer says to browsers: run nothing of it, show it in no frame, keep no copy."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from covista_service.api.docs_page import DOCS

_ALWAYS = {
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
}
_CONTENT = "default-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
# The page of the description has a script of its own.
_DOCS = (
    "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
# Browsers hold to it at all ports of the host, and others may serve there without TLS.
_A_DAY = "max-age=86400"


def with_headers(app: ASGIApp) -> ASGIApp:
    """Adds them to every answer, errors too; what a route says itself stands."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                _complete(MutableHeaders(scope=message), scope)
            await send(message)

        await app(scope, receive, sending)

    return answer


def _complete(headers: MutableHeaders, scope: Scope) -> None:
    for name, value in _ALWAYS.items():
        headers.setdefault(name, value)
    headers.setdefault("content-security-policy", _DOCS if scope["path"] == DOCS else _CONTENT)
    # What has a version may be kept by who asked, to be asked for again; all else is stale at once, and not for others.
    headers.setdefault("cache-control", "private, no-cache" if "etag" in headers else "no-store")
    if scope["scheme"] == "https":
        headers.setdefault("strict-transport-security", _A_DAY)
