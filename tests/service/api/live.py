"""A station that runs, with a history, behind a real server."""

import asyncio
import json
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

import httpx
import uvicorn
from covista_schemas.reports import EventKind, EventReport, time_of
from covista_service.api.connection import Connection, Patience
from covista_service.api.deps import Parts
from covista_service.api.stream import Stream
from covista_service.loop import News
from covista_service.store.history import History
from covista_service.store.retention import Retention

from tests.service.api.conftest import Desk
from tests.service.deadline import wait_until

_T = TypeVar("_T")
DEADLINE_S = 10.0
# Scenes play years ago.
FOR_EVER = Retention(days=36_500)


@dataclass
class Site:
    """What outsiders see, and a hand on what is inside."""

    desk: Desk
    history: History
    port: int
    server: uvicorn.Server
    asyncio: asyncio.AbstractEventLoop

    @property
    def parts(self) -> Parts:
        return self.desk.parts

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def ask(self, method: str, path: str, **details: Any) -> httpx.Response:
        return httpx.request(method, f"{self.url}/api/v1{path}", timeout=DEADLINE_S, **details)

    def get(self, path: str, **details: Any) -> httpx.Response:
        return self.ask("GET", path, **details)

    def inside(self, work: Callable[[], _T]) -> _T:
        """Do something in the thread of the event loop."""
        done: Future[_T] = Future()
        self.asyncio.call_soon_threadsafe(lambda: done.set_result(work()))
        return done.result(DEADLINE_S)

    def publish(self, numbers: Sequence[int], *, store: bool = True, tell: bool = True) -> None:
        """Have events with these numbers happen."""
        news = news_of(self.desk, numbers)
        if store:
            self.history.take(news)
        if tell:
            self.inside(partial(self.parts.stream.take, news))

    def stored(self, number: int) -> None:
        """Wait until the history has an event."""
        wait_until(lambda: self.parts.archive.events_after(number - 1, 1), f"event {number} is stored")


def news_of(desk: Desk, numbers: Sequence[int]) -> News:
    return News(desk.scene.snapshot, tuple(event(number) for number in numbers), False, ())


def event(number: int, text: str = "r1 is live") -> EventReport:
    time = time_of(1_700_000_000_000_000_000 + number * 1_000_000)
    return EventReport(id=number, event=EventKind.STATUS, time=time, robots=["r1"], text=text)


@contextmanager
def site(folder: Path, stream: Stream | None = None, patience: Patience | None = None) -> Iterator[Site]:
    """Serve in a thread of its own, as `serve.run` does; at the end all has stopped."""
    database = f"sqlite:///{folder / 'covista.db'}"
    desk = Desk(database=database)
    desk.scene.send("r1")
    desk.scene.send("r2")
    desk.scene.settle()
    with closing(History(database, retention=FOR_EVER)) as history, closing(desk.archive):
        desk.parts = replace(desk.parts, stream=stream or Stream())
        desk.parts.loop._sinks = (history, desk.parts.stream)
        made = partial(
            Connection,
            given_up=desk.parts.outgoing.given_up,
            patience=patience or Patience(),
            listening=lambda: desk.parts.stream.listeners,
        )

        async def app(scope: Any, receive: Any, send: Any) -> None:
            await desk._stateful(scope, receive, send)

        config = uvicorn.Config(
            app,
            http=cast(type[asyncio.Protocol], made),
            lifespan="off",
            log_config=None,
            access_log=False,
            timeout_graceful_shutdown=1,
        )
        server = uvicorn.Server(config)
        loops: list[asyncio.AbstractEventLoop] = []

        async def run() -> None:
            loops.append(asyncio.get_running_loop())
            task = asyncio.create_task(desk.parts.loop.run())
            await server.serve([listener])
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

        with socket.create_server(("127.0.0.1", 0)) as listener:
            thread = threading.Thread(target=lambda: asyncio.run(run()), name="site")
            thread.start()
            try:
                wait_until(lambda: server.started and desk.parts.loop.running)
                yield Site(desk, history, listener.getsockname()[1], server, loops[0])
            finally:
                loops[0].call_soon_threadsafe(desk.parts.stream.close)
                server.should_exit = True
                thread.join()


@dataclass(frozen=True)
class Heard:
    """An event of a stream."""

    id: int | None
    event: str
    data: dict[str, Any]


class Ear:
    """A client that listens to events, and reads when it is told to."""

    def __init__(self, site: Site, last: int | None = None, query: str = "", receive_bytes: int | None = None) -> None:
        self._socket = socket.socket()
        if receive_bytes is not None:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        self._socket.settimeout(DEADLINE_S)
        self._socket.connect(("127.0.0.1", site.port))
        header = "" if last is None else f"last-event-id: {last}\r\n"
        self._socket.sendall(f"GET /api/v1/events{query} HTTP/1.0\r\nhost: localhost\r\n{header}\r\n".encode())
        self._file = self._socket.makefile("rb")
        self.status = int(self._file.readline().split()[1])
        lines = iter(self._file.readline, b"\r\n")
        self.headers = dict(line.decode().strip().lower().split(": ", 1) for line in lines)
        self.comments = 0
        # The id that the stream began with.
        self.at: int | None = None

    def __enter__(self) -> "Ear":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        self._socket.close()

    def next(self) -> Heard | None:
        """The next event; None at the end of the stream."""
        fields: dict[str, str] = {}
        while line := self._file.readline():
            text = line.decode().rstrip("\n")
            if text.startswith(":"):
                self.comments += 1
            elif text:
                name, _, value = text.partition(": ")
                fields[name] = value
            elif fields.keys() == {"id"}:
                # An id alone is no event: it is what to come back with.
                self.at = int(fields.pop("id"))
            elif fields:
                number = fields.get("id")
                return Heard(None if number is None else int(number), fields["event"], json.loads(fields["data"]))
        return None

    def until(self, number: int) -> list[Heard]:
        """All up to the event with this id."""
        heard = []
        while not heard or heard[-1].id != number:
            one = self.next()
            assert one is not None, f"the stream ended before {number}: {heard}"
            heard.append(one)
        return heard

    def rest(self) -> list[Heard]:
        """All to the end."""
        return list(iter(self.next, None))

    def heartbeat(self) -> None:
        """Wait for a comment."""
        while not (line := self._file.readline()).startswith(b":"):
            assert line, "the stream ended"
        self.comments += 1
