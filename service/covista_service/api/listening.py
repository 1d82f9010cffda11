"""The stream of events as one client hears it: what is past first, then what happens, without a hole or a repeat.

Written by hand, since neither FastAPI's own nor sse-starlette's answers share an event's text among listeners or tell
one who reads too slowly why he is cut off.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable
from contextlib import aclosing
from typing import Any

from covista_schemas.reports import EventReport, Problem
from fastapi import Response
from starlette.types import Receive, Scope, Send

from covista_service.answers.past import Archive, HistoryUnavailableError
from covista_service.api.delivery import CUT
from covista_service.api.errors import refuse
from covista_service.api.stream import EVENT_STREAM, LONG_ENOUGH, CrowdedError, Listener, Stream, encode, missed
from covista_service.loop.rooms import Room

HEARTBEAT_S = 15.0
# In the scope of a request: HEAD was asked, and what has no end must not begin.
HEAD_ONLY = "covista.head"
_HEARTBEAT = b": alive\n\n"
_PAGE = 500
_HEADERS = {"cache-control": "no-store", "x-accel-buffering": "no"}


class Listening(Response):
    """Events after a number, or those to come, until the client goes or is cut off."""

    media_type = EVENT_STREAM

    def __init__(self, stream: Stream, archive: Archive, readers: Room, after: int | None) -> None:
        super().__init__(headers=_HEADERS)
        del self.headers["content-length"]
        self._stream = stream
        self._archive = archive
        self._readers = readers
        self._after = after
        self._send: Send
        self._over = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Listen, or hear that as many do as may."""
        self._send = send
        extensions: dict[str, Any] = scope.get("extensions") or {}
        try:
            listener = self._stream.enter(extensions.get(CUT, _nothing))
        except CrowdedError as error:
            problem = Problem(title=str(error), status=503, instance=scope["path"])
            await refuse(problem, {"retry-after": "10"})(scope, receive, send)
            return
        watching = asyncio.create_task(_watch(receive, listener))
        try:
            await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
            if not scope.get(HEAD_ONLY):
                await self._listen(listener)
            await send({"type": "http.response.body", "body": b""})
        finally:
            watching.cancel()
            self._stream.leave(listener)

    async def _listen(self, listener: Listener) -> None:
        until_s = asyncio.get_running_loop().time() + self._stream.longest_s
        position = self._after
        if position is None:
            # Whoever loses the connection before the first event knows all the same after which to come back.
            position = self._stream.last
            await self._put(b"id: %d\n\n" % position)
        else:
            async with aclosing(self._past(position)) as past:
                async for number, text in past:
                    position = number
                    await self._put(text)
                    if listener.ended:
                        break
        # Nothing is awaited between the last look at what is kept here and this, so no event falls between them.
        late = b"" if listener.ended else self._stream.hear(listener, position)
        await self._put(late or _HEARTBEAT)
        await self._go_on(listener, until_s)

    async def _go_on(self, listener: Listener, until_s: float) -> None:
        clock = asyncio.get_running_loop().time
        while not self._over:
            left_s = until_s - clock()
            if left_s <= 0:
                listener.end(LONG_ENOUGH)
            text = await listener.next(min(HEARTBEAT_S, max(left_s, 0.0)))
            self._over = listener.ended
            await self._put(text or _HEARTBEAT)

    async def _put(self, text: bytes) -> None:
        await self._send({"type": "http.response.body", "body": text, "more_body": True})

    async def _past(self, after: int) -> AsyncGenerator[tuple[int, bytes], None]:
        """What the history has after a number and the stream does not keep any more, each text with its last number."""
        stream, position = self._stream, after
        if after > stream.last:
            yield stream.last, missed(1, stream.last, "the numbers of events have begun anew since that id was given")
            return
        if position < stream.since - 1:
            oldest = await self._oldest()
            if oldest > position + 1:
                position = oldest - 1
                yield position, missed(after + 1, position, "older than what is kept, or the history cannot be read")
        while position < stream.since - 1:
            events = await self._read(position)
            text = b""
            for event in events:
                text += self._hole(position, event.id) + encode(event.event, event, event.id)
                position = event.id
            if not events:
                since = stream.since
                text, position = self._hole(position, since), since - 1
            yield position, text

    async def _oldest(self) -> int:
        """The number of the oldest event in the history, or of the first that is kept here."""
        try:
            oldest = await self._readers.run(self._archive.oldest_event, patient=True)
        except HistoryUnavailableError:
            oldest = None
        return self._stream.since if oldest is None else min(oldest, self._stream.since)

    async def _read(self, after: int) -> list[EventReport]:
        """The next events of the history after a number, as far as they are not kept here."""
        try:
            events = await self._readers.run(lambda: self._archive.events_after(after, _PAGE), patient=True)
        except HistoryUnavailableError:
            return []
        return [event for event in events if after < event.id < self._stream.since]

    def _hole(self, before: int, number: int) -> bytes:
        """Word of events between two that the history does not have, though there were some since this start."""
        first = max(before + 1, self._stream.first)
        return missed(first, number - 1, "not in the history, or not yet") if first < number else b""


async def _watch(receive: Receive, listener: Listener) -> None:
    """End when the client goes."""
    waiting: Awaitable[Any] = receive()
    while (await waiting)["type"] != "http.disconnect":
        waiting = receive()
    listener.end()


def _nothing() -> None:
    """There is no connection to cut."""
