"""Lets requests in by their token, and says in HTTP why one stays out.

Closed unless named here: a route that is added needs a token without anybody thinking of it. What is open tells nothing
of the robots: who restarts the station, or sends it work, asks `/healthz` and `/readyz` and keeps no secrets, and the
description is the same for every station, but for whether it asks for tokens.

Who has logged in shows a cookie instead of a token. Browsers send that whoever made them ask, so it counts only where
they say that a page of this station did.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from http import HTTPStatus
from ipaddress import ip_address
from typing import Any
from urllib.parse import quote, urlsplit

from covista_schemas.reports import Problem
from fastapi import Response
from fastapi.responses import RedirectResponse
from starlette.datastructures import Headers
from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Message, Receive, Send
from starlette.types import Scope as Request

from covista_service.access import Admitted, Gate, Pages, Refusal, Refused, Scope, is_loopback
from covista_service.access.sessions import COOKIE
from covista_service.api.delivery import CUT
from covista_service.api.deps import State
from covista_service.api.docs_page import FILE_NAMES, FILES
from covista_service.api.errors import refuse
from covista_service.api.stream import CUT_EVENT, EVENT_STREAM, encode
from covista_service.api.timing import PREFIX

# In the scope of a request: the name of the token that it came with, or None.
BY = "covista.by"
# The page of the description is the same for every station, and so are its files.
OPEN = frozenset({"/", "/healthz", "/readyz", "/docs", "/openapi.json"} | {f"{FILES}/{name}" for name in FILE_NAMES})
_ASKS = frozenset({"GET", "HEAD", "OPTIONS"})
# Computes, and changes nothing.
_ASKS_BY_POST = frozenset({f"{PREFIX}/groups/preview"})
_REALM = 'Bearer realm="covista"'

_WHY: dict[Refusal, tuple[HTTPStatus, str, str]] = {
    Refusal.MISSING: (HTTPStatus.UNAUTHORIZED, "a token is needed: Authorization: Bearer covista_...", ""),
    Refusal.MALFORMED: (
        HTTPStatus.UNAUTHORIZED,
        "one header is expected: Authorization: Bearer covista_...",
        'error="invalid_request"',
    ),
    Refusal.UNKNOWN: (HTTPStatus.UNAUTHORIZED, "this token is not known", 'error="invalid_token"'),
    Refusal.REVOKED: (HTTPStatus.UNAUTHORIZED, "this token is revoked", 'error="invalid_token"'),
    Refusal.SESSION: (HTTPStatus.UNAUTHORIZED, "this session has ended: log in again", ""),
    Refusal.ORIGIN: (HTTPStatus.FORBIDDEN, "a page of somebody else has made the browser ask", ""),
    Refusal.SCOPE: (HTTPStatus.FORBIDDEN, "this needs a token of scope {wanted}", 'error="insufficient_scope"'),
    Refusal.LIMITED: (HTTPStatus.TOO_MANY_REQUESTS, "too many requests without a token that is good", ""),
    Refusal.UNREAD: (HTTPStatus.SERVICE_UNAVAILABLE, "the tokens cannot be read; nobody is let in before", ""),
    Refusal.HOST: (
        HTTPStatus.FORBIDDEN,
        "without tokens the station answers only to localhost and to addresses, not to other names for them",
        "",
    ),
}
# What logging in can mend.
_LOG_IN = frozenset({Refusal.MISSING, Refusal.SESSION})
# What a websocket that may not go on is closed with (RFC 6455).
_NOT_ALLOWED = 1008
# Until the tokens are read, which is tried every second.
_UNREAD_RETRY_S = 2


def wanted_scope(method: str, path: str) -> Scope | None:
    """What a request needs; None where it is open. Paths are those of requests or templates of routes."""
    if path in OPEN:
        return None
    return Scope.READ if method in _ASKS or (method == "POST" and path in _ASKS_BY_POST) else Scope.OPERATE


def guarded(pages: Pages | None = None) -> Callable[[ASGIApp], ASGIApp]:
    """Lets in only what the gate of the station admits, and notes by whom it was asked."""

    def guard(app: ASGIApp) -> ASGIApp:
        async def answer(scope: Request, receive: Receive, send: Send) -> None:
            if scope["type"] == "websocket":
                admitted = pages is not None and await _opens_socket(scope, pages)
                await (app(scope, _while_open(scope, receive, send), send) if admitted else _hang_up(send))
                return
            if scope["type"] != "http":
                await app(scope, receive, send)
                return
            path, mine = scope["path"], pages if pages is not None and pages.holds(scope["path"]) else None
            wanted = wanted_scope(scope["method"], path) if mine is None else mine.wanted_scope(path)
            found = _judge_open(scope, mine) if wanted is None else await _judge(scope, wanted, pages=mine is not None)
            if isinstance(found, Refused):
                sent_on = mine is not None and mine.is_page(path) and found.reason in _LOG_IN
                refusal = _to_log_in(scope, mine) if mine and sent_on else _refusal(found, path, wanted)
                await refusal(scope, receive, send)
                return
            scope[BY] = found.by
            await app(scope, receive, send if wanted is None else _while_let_in(scope, found.by, wanted, send))

        return answer

    return guard


async def _opens_socket(scope: Request, pages: Pages) -> bool:
    """Whether a page of this station opens a websocket, for who may read."""
    headers = Headers(scope=scope)
    below = scope["path"].startswith(f"{pages.prefix}{pages.sockets}")
    if not below or not _is_own_page(headers) or "origin" not in headers:
        return False
    return isinstance(await _judge(scope, Scope.READ, pages=True), Admitted)


def _while_open(scope: Request, receive: Receive, send: Send) -> Receive:
    """Hears a websocket until who opened it would not be let in any more; pages say something every few seconds."""
    gate, headers = _gate_of(scope), Headers(scope=scope)
    session = _session_of(headers)
    by_token = bool(headers.getlist("authorization"))

    async def receiving() -> Message:
        message = await receive()
        if message["type"] == "websocket.receive" and not (by_token or gate.holds(session)):
            await _hang_up(send)
            return {"type": "websocket.disconnect", "code": _NOT_ALLOWED}
        return message

    return receiving


def _to_log_in(scope: Request, pages: Pages) -> Response:
    """And from there back to where one wanted to go."""
    root, back = scope.get("root_path", ""), scope["path"].removeprefix(pages.prefix) or "/"
    asked = scope["query_string"].decode("latin-1")
    if scope["method"] not in _ASKS:
        back = "/"
    elif asked:
        back = f"{back}?{asked}"
    return RedirectResponse(f"{root}{pages.prefix}{pages.log_in}?next={quote(back)}", HTTPStatus.SEE_OTHER)


def _while_let_in(scope: Request, by: str | None, wanted: Scope, send: Send) -> Send:
    """Sends until the token is revoked, the session ends, or the first token is made: a stream would outlive that."""
    gate, headers = _gate_of(scope), Headers(scope=scope)
    session = _session_of(headers) if "authorization" not in headers else ""
    over = is_stream = False
    start: Message | None = None

    async def sending(message: Message) -> None:
        nonlocal over, is_stream, start
        if over:
            return
        if message["type"] == "http.response.start":
            is_stream = Headers(raw=message["headers"]).get("content-type", "").startswith(EVENT_STREAM)
            if not is_stream:
                # Goes with what comes first: an answer of which nothing is out is refused, not cut.
                start = message
                return
        elif start is not None and not message.get("more_body", False):
            # Ready as a whole for who was let in when it was asked for; to log out is to be told so, too.
            pass
        elif not (gate.holds(session) if session else gate.keyring.lets_in(by)):
            over = True
            reason = Refusal.MISSING if by is None else Refusal.SESSION if session else Refusal.REVOKED
            if start is None:
                await _cut(scope, send, reason, is_stream)
            else:
                await _refusal(Refused(reason), scope["path"], wanted)(scope, _nothing_more, send)
            return
        if start is not None:
            begin, start = start, None
            await send(begin)
        await send(message)

    return sending


async def _nothing_more() -> Message:
    return {"type": "http.disconnect"}


async def _cut(scope: Request, send: Send, reason: Refusal, is_stream: bool) -> None:
    """End an answer short, so that nobody takes it for whole; a stream has a last word for that."""
    extensions: dict[str, Any] = scope.get("extensions") or {}
    if is_stream:
        status, detail, _ = _WHY[reason]
        farewell = encode(CUT_EVENT, Problem(title=status.phrase, status=status, detail=detail))
        await send({"type": "http.response.body", "body": farewell, "more_body": False})
    elif CUT in extensions:
        extensions[CUT]()
        # The server must hear that the connection is gone before the answer ends.
        await asyncio.sleep(0)
    else:
        await send({"type": "http.response.body", "body": b"", "more_body": False})


def _gate_of(scope: Request) -> Gate:
    state: State = scope["state"]
    return state["parts"].gate


async def _hang_up(send: Send) -> None:
    await send({"type": "websocket.close", "code": _NOT_ALLOWED})


def _judge_open(scope: Request, pages: Pages | None) -> Admitted | Refused:
    """What is open is so to everybody, but a form of ours is sent by our own pages: it says who somebody is."""
    if pages is None or scope["method"] in _ASKS or _is_own_page(Headers(scope=scope)):
        return Admitted()
    return _gate_of(scope).refuse(Refusal.ORIGIN, _address_of(scope))


async def _judge(scope: Request, wanted: Scope, *, pages: bool) -> Admitted | Refused:
    """`pages` are for people in a browser, who show a session, or nothing before they have logged in."""
    gate = _gate_of(scope)
    headers = Headers(scope=scope)
    address = _address_of(scope)
    credentials, session = headers.getlist("authorization"), _session_of(headers)
    if not credentials and (session or pages):
        found = gate.admit_session(session, wanted, address)
        if isinstance(found, Admitted) and not _is_own_page(headers, asks=scope.get("method") in _ASKS):
            return gate.refuse(Refusal.ORIGIN, address, by=found.by)
    else:
        found = await gate.admit(credentials, wanted, address)
    if found == Admitted() and not _may_be_called(gate, headers.get("host", "")):
        return gate.refuse(Refusal.HOST, address)
    return found


def _address_of(scope: Request) -> str:
    return str((scope.get("client") or ("",))[0])


def _session_of(headers: Headers) -> str:
    return cookie_parser(headers.get("cookie", "")).get(COOKIE, "")


def _is_own_page(headers: Headers, *, asks: bool = False) -> bool:
    """Whether a browser asks because of a page of this station; one may come from anywhere to what it only `asks` for.

    Browsers say so in Sec-Fetch-Site (Fetch Metadata); those of before 2023, and all where the station is neither at
    localhost nor behind TLS, in Origin alone.
    """
    if asks and headers.get("sec-fetch-mode") == "navigate":
        return True
    site, origin = headers.get("sec-fetch-site"), headers.get("origin")
    if site is not None:
        return site in ("same-origin", "none")
    return origin is None or urlsplit(origin).netloc == headers.get("host")


def _may_be_called(gate: Gate, host: str) -> bool:
    """Where no token is needed, a page of somebody else could give its own name this address and ask in the browser."""
    if gate.any_host:
        return True
    name = host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() and not host.endswith("]") else host
    return is_loopback(name.strip("[]")) or _is_address(name.strip("[]"))


def _is_address(host: str) -> bool:
    try:
        ip_address(host)
    except ValueError:
        return False
    return True


def _refusal(refused: Refused, path: str, wanted: Scope | None) -> Response:
    status, detail, error = _WHY[refused.reason]
    headers: dict[str, str] = {}
    if status in (HTTPStatus.UNAUTHORIZED, HTTPStatus.FORBIDDEN) and refused.reason is not Refusal.HOST:
        needs = f'scope="{wanted}"'
        headers["www-authenticate"] = ", ".join(part for part in (_REALM, error, needs) if part)
    retry_after_s = _UNREAD_RETRY_S if refused.reason is Refusal.UNREAD else refused.retry_after_s
    if retry_after_s:
        headers["retry-after"] = str(retry_after_s)
    problem = Problem(title=status.phrase, status=status, detail=detail.format(wanted=wanted), instance=path)
    return refuse(problem, headers)
