"""Answers that are sent as fast as their client reads and no faster."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

from covista_schemas.reports import Problem
from fastapi import Response
from starlette.types import Receive, Scope, Send

from covista_service.api.errors import refuse
from covista_service.api.outgoing import CHUNK_BYTES, Body, Outgoing, body_of

# A client may take so long over an answer, however large.
DELIVERY_S = 120.0
# In the scope of a request: what cuts its connection off, for a reason.
CUT = "covista.cut"
SLOW, BUSY = "slow", "busy"


class Delivery(Response):
    """A large answer in pieces; the next goes out when the connection has room for it."""

    def __init__(self, body: Body, outgoing: Outgoing, media_type: str, headers: Mapping[str, str] | None = None):
        super().__init__(headers={**(headers or {}), "content-length": str(body.size)}, media_type=media_type)
        self._content = body
        self._outgoing = outgoing

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send, or refuse where too much is on its way."""
        if not self._outgoing.take(self._content):
            self._outgoing.given_up[BUSY] += 1
            await _busy(scope)(scope, receive, send)
            return
        try:
            async with asyncio.timeout(DELIVERY_S):
                await self._send(send)
        except TimeoutError:
            self._outgoing.given_up[SLOW] += 1
            await _cut(scope)
        finally:
            self._outgoing.give_back(self._content)

    async def _send(self, send: Send) -> None:
        await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
        for chunk in self._content.chunks:
            await self._outgoing.chunk_turn()
            await send({"type": "http.response.body", "body": chunk, "more_body": True})
        await send({"type": "http.response.body", "body": b""})


def deliver(content: bytes, outgoing: Outgoing, media_type: str) -> Response:
    """An answer of these bytes, in pieces if it is large."""
    if len(content) <= CHUNK_BYTES:
        return Response(content, media_type=media_type)
    return Delivery(body_of([content]), outgoing, media_type)


def _busy(scope: Scope) -> Response:
    title = "Too many answers are on their way to clients that read slowly"
    return refuse(Problem(title=title, status=503, instance=scope["path"]), {"retry-after": "10"})


async def _cut(scope: Scope) -> None:
    extensions: dict[str, Any] = scope.get("extensions") or {}
    if CUT in extensions:
        extensions[CUT]()
        # The server must hear that the connection is gone before this answer ends short.
        await asyncio.sleep(0)
