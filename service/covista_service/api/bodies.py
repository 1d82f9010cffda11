"""What requests bring with them: not much, and not slowly."""

from __future__ import annotations

import asyncio
from http import HTTPStatus

from covista_schemas.reports import Problem
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from covista_service.api.errors import refuse

# The largest that makes sense, all live settings at once, is a hundredth of this.
MAX_BYTES = 64 * 1024
TIMEOUT_S = 10.0
_TOO_LONG = f"a request may bring {MAX_BYTES} bytes"
_TOO_SLOW = f"the body of a request must come within {TIMEOUT_S:g} s"


class _RefusedError(Exception):
    """Carries what to answer."""

    def __init__(self, status: HTTPStatus, detail: str) -> None:
        super().__init__(detail)
        self.status = status
        self.detail = detail


class _GoneError(Exception):
    """The client has closed the connection."""


def bounded(app: ASGIApp) -> ASGIApp:
    """Takes in the body before a route hears of the request: 413 where it is too long, 408 where it is too slow."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        announced = int(headers.get("content-length", "0"))
        if scope["type"] != "http" or (announced == 0 and "transfer-encoding" not in headers):
            await app(scope, receive, send)
            return
        try:
            body = await _read(receive, announced)
        except _GoneError:
            return
        except _RefusedError as error:
            said = Problem(title=error.status.phrase, status=error.status, detail=error.detail, instance=scope["path"])
            await refuse(said)(scope, receive, send)
            return
        await app(scope, _replayed(body, receive), send)

    return answer


async def _read(receive: Receive, announced: int) -> bytes:
    """The whole body, whatever length was announced for it."""
    if announced > MAX_BYTES:
        raise _RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, _TOO_LONG)
    body = bytearray()
    try:
        async with asyncio.timeout(TIMEOUT_S):
            while True:
                message = await receive()
                if message["type"] == "http.disconnect":
                    raise _GoneError
                body += message.get("body", b"")
                if len(body) > MAX_BYTES:
                    raise _RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, _TOO_LONG)
                if not message.get("more_body", False):
                    return bytes(body)
    except TimeoutError as error:
        raise _RefusedError(HTTPStatus.REQUEST_TIMEOUT, _TOO_SLOW) from error


def _replayed(body: bytes, receive: Receive) -> Receive:
    """Gives the body at once, and then what the connection tells."""
    given = False

    async def receiving() -> Message:
        nonlocal given
        if given:
            return await receive()
        given = True
        return {"type": "http.request", "body": body, "more_body": False}

    return receiving
