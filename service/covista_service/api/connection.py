"""A client's connection, for who does not read, does not ask, or is one too many."""

from __future__ import annotations

import asyncio
import socket
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import h11
from covista_schemas.reports import Problem
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

from covista_service.api.delivery import CUT, SLOW
from covista_service.api.errors import refuse
from covista_service.api.headers import with_headers

# What the system keeps unsent for a client: bounds what hundreds cost, and lets a slow one be seen to move.
_SEND_BUFFER_BYTES = 128 * 1024
SILENT, CROWD = "silent", "crowd"
# Whoever asks whether the station works, and why not, should hear it, however many others there are.
_ALWAYS = ("/healthz", "/readyz", "/metrics")


@dataclass(frozen=True, slots=True)
class Patience:
    """Connections are looked at every `look_s`: one on which nothing moved since the last look is cut.

    Beyond `connections` requests are refused, and beyond twice as many so are connections; those that listen to events
    do not count.
    """

    look_s: float = 15.0
    connections: int = 256


class Connection(H11Protocol):
    """Uvicorn's protocol, that cuts connections on which nothing moves; `given_up` counts them by reason."""

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
        *,
        given_up: Counter[str],
        patience: Patience | None = None,
        listening: Callable[[], int] = lambda: 0,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self._given_up = given_up
        self._patience = patience or Patience()
        self._listening = listening
        self._served = self.app
        self.app = self._answer
        self._next_look: asyncio.TimerHandle | None = None
        self._moves = 0
        self._seen = (0, 0)
        self._unsent = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn narrows it
        """Take a client in."""
        super().connection_made(transport)
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        if self._others > 2 * self._patience.connections:
            self._cut(CROWD)
            return
        self._look_later()

    def connection_lost(self, exc: Exception | None) -> None:
        """The client is gone."""
        if self._next_look is not None:
            self._next_look.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """The client says something."""
        under_way = self._under_way
        super().data_received(data)
        # A head that comes in drops is no sign of life.
        self._moves += self._under_way and not under_way

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """From now on it is another protocol's, which has pings of its own to tell who is gone."""
        if self._next_look is not None:
            self._next_look.cancel()
        super().handle_websocket_upgrade(event)

    def resume_writing(self) -> None:
        """The client has read."""
        self._moves += 1
        super().resume_writing()

    @property
    def _others(self) -> int:
        """Connections that neither listen to events nor are websockets: pages have a bound of their own."""
        return sum(isinstance(each, Connection) for each in self.connections) - self._listening()

    @property
    def _under_way(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete

    async def _note(self, send: Send, message: Message) -> None:
        """Send a part of an answer; that it goes out, or that an earlier one has, is a sign of life."""
        self._look_at_unsent()
        await send(message)
        self._unsent = self.transport.get_write_buffer_size()
        self._moves += not self._unsent

    def _look_at_unsent(self) -> None:
        """What has been taken since something was sent: nothing else makes it less."""
        unsent = self.transport.get_write_buffer_size()
        self._moves += unsent < self._unsent
        self._unsent = unsent

    def _look_later(self) -> None:
        self._next_look = self.loop.call_later(self._patience.look_s, self._look)

    def _look(self) -> None:
        """Cut the connection if nothing moved since the last look and something should have."""
        self._look_at_unsent()
        unsent = self.transport.get_write_buffer_size()
        moves, before = self._seen
        self._seen = (self._moves, unsent)
        if self._moves == moves and unsent and unsent >= before > 0:
            self._cut(SLOW)
        elif self._moves == moves and not unsent and not self._under_way:
            self._cut(SILENT)
        else:
            self._look_later()

    def _cut(self, reason: str) -> None:
        self._given_up[reason] += 1
        self.transport.abort()

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        scope["extensions"] = {**(scope.get("extensions") or {}), CUT: self.transport.abort}
        app: ASGIApp = self._served
        if self._others > self._patience.connections and scope.get("path") not in _ALWAYS:
            self._given_up[CROWD] += 1
            app = refuse(
                Problem(title="Too many connections", status=503, instance=scope.get("path")),
                {"retry-after": "10", "connection": "close"},
            )
        await with_headers(app)(scope, receive, partial(self._note, send))
