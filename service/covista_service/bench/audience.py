"""Mission control in numbers: many clients that ask for the same, and listeners that follow events.

A process of its own. Each client has a connection that it keeps, and speaks HTTP/1.1 with little besides: what it
costs itself would be measured with the station.
"""

from __future__ import annotations

import asyncio
import random
import threading
import time
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from urllib.parse import urlsplit

import h11
from covista_schemas.reports import EventKind, EventReport

from covista_service.demo.children import Line, end_soon

_PIECE_BYTES = 64 * 1024
_TIMEOUT_S = 10.0


@dataclass(frozen=True, slots=True)
class AudienceOptions:
    """`clients` ask for each of `paths` once in `period_s`, and `listeners` follow events."""

    url: str
    paths: tuple[str, ...] = ()
    clients: int = 0
    period_s: float = 1.0
    listeners: int = 0


@dataclass(frozen=True, slots=True)
class Attended:
    """What the audience saw since it was asked last.

    `times_ms` are those of all answers by path, `failures` counts those that were none. `delays_ms` are those of each
    event that says that groups have changed, for every listener that heard of it; `heard` are their ids.
    """

    times_ms: dict[str, tuple[float, ...]]
    failures: int
    delays_ms: tuple[float, ...]
    heard: dict[int, int]


class Audience:
    """All clients and listeners, in one event loop."""

    def __init__(self, options: AudienceOptions) -> None:
        self._options = options
        split = urlsplit(options.url)
        self._host, self._port = split.hostname or "127.0.0.1", split.port or 80
        self.listening = asyncio.Event()
        self._listeners = 0
        self._start_anew()

    async def attend(self) -> None:
        """Ask and listen until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            for number in range(self._options.clients):
                tasks.create_task(self._ask_all(random.Random(number)))
            for _ in range(self._options.listeners):
                tasks.create_task(self._listen())
            if not self._options.listeners:
                self.listening.set()

    def told(self) -> Attended:
        """What it saw, and begin anew."""
        times_ms = {path: tuple(times) for path, times in self._times_ms.items()}
        attended = Attended(times_ms, self._failures, tuple(self._delays_ms), dict(self._heard))
        self._start_anew()
        return attended

    def _start_anew(self) -> None:
        self._times_ms: dict[str, list[float]] = {path: [] for path in self._options.paths}
        self._failures = 0
        self._delays_ms: list[float] = []
        self._heard: dict[int, int] = {}

    async def _ask_all(self, chance: random.Random) -> None:
        """One client; all of them begin at different moments."""
        period_s = self._options.period_s
        due_s = time.monotonic() + period_s * chance.random()
        while True:
            try:
                async with self._connection() as connection:
                    while True:
                        for path in self._options.paths:
                            await asyncio.sleep(max(0.0, due_s - time.monotonic()))
                            await self._ask(connection, path, due_s)
                            due_s += period_s / len(self._options.paths)
            except (OSError, TimeoutError, h11.ProtocolError):
                self._failures += 1
                await asyncio.sleep(period_s)
                due_s = time.monotonic()

    async def _ask(self, connection: _Connection, path: str, due_s: float) -> None:
        async with asyncio.timeout(_TIMEOUT_S):
            await connection.ask(path)
            status = 0
            async for event in connection.answer():
                if isinstance(event, h11.Response):
                    status = event.status_code
        # Who had to wait for the answer before this question was due at its time all the same.
        self._times_ms[path].append(1e3 * (time.monotonic() - due_s))
        self._failures += status != 200

    async def _listen(self) -> None:
        async with self._connection() as connection:
            await connection.ask("/api/v1/events")
            rest = b""
            async for event in connection.answer():
                if isinstance(event, h11.Response):
                    self._listeners += 1
                    if self._listeners == self._options.listeners:
                        self.listening.set()
                elif isinstance(event, h11.Data):
                    *lines, rest = (rest + bytes(event.data)).split(b"\n")
                    for line in lines:
                        self._hear(line)
        self._failures += 1

    def _hear(self, line: bytes) -> None:
        if not line.startswith(b"data:") or b'"event":"groups"' not in line:
            return
        report = EventReport.read(line.removeprefix(b"data:").strip())
        if report.event is EventKind.GROUPS:
            self._delays_ms.append(1e3 * (time.time() - report.time.timestamp()))
            self._heard[report.id] = self._heard.get(report.id, 0) + 1

    @asynccontextmanager
    async def _connection(self) -> AsyncIterator[_Connection]:
        reader, writer = await asyncio.open_connection(self._host, self._port)
        async with AsyncExitStack() as stack:
            stack.callback(writer.close)
            yield _Connection(reader, writer, f"{self._host}:{self._port}")


class _Connection:
    """One connection that is used again and again."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, host: str) -> None:
        self._reader = reader
        self._writer = writer
        self._host = host
        self._http = h11.Connection(h11.CLIENT)

    async def ask(self, path: str) -> None:
        """Send a question."""
        if self._http.our_state is not h11.IDLE:
            self._http.start_next_cycle()
        request = h11.Request(method="GET", target=path, headers=[("host", self._host)])
        self._writer.write((self._http.send(request) or b"") + (self._http.send(h11.EndOfMessage()) or b""))
        await self._writer.drain()

    async def answer(self) -> AsyncIterator[h11.Event]:
        """The answer in pieces, to its end."""
        while True:
            event = self._http.next_event()
            if event is h11.NEED_DATA:
                self._http.receive_data(await self._reader.read(_PIECE_BYTES))
            elif isinstance(event, h11.EndOfMessage | h11.ConnectionClosed):
                return
            elif isinstance(event, h11.Event):
                yield event


def play(line: Line, options: AudienceOptions) -> None:
    """Attend; say "ready" once all listen, and answer every word with what was seen since the last."""
    asyncio.run(_play(line, options))


async def _play(line: Line, options: AudienceOptions) -> None:
    loop, gone = asyncio.get_running_loop(), asyncio.Event()
    audience = Audience(options)

    def obey() -> None:
        while line.receive() is not None:
            loop.call_soon_threadsafe(lambda: line.send(audience.told()))
        end_soon()
        loop.call_soon_threadsafe(gone.set)

    attending = asyncio.create_task(audience.attend())
    async with asyncio.timeout(_TIMEOUT_S):
        await audience.listening.wait()
    threading.Thread(target=obey, name="orders", daemon=True).start()
    line.send("ready")
    await asyncio.wait([asyncio.create_task(gone.wait()), attending], return_when=asyncio.FIRST_COMPLETED)
    attending.cancel()
