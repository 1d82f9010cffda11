"""Jobs at a Dask cluster, and here while it is away."""

from __future__ import annotations

import asyncio
import logging
import os
import threading
import time
from concurrent.futures import Future
from contextlib import suppress
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, TypeVar

from covista_service.loop import CrewStatus
from covista_service.workers.connection import Connection, OverdueError, Post, PostLostError, unlike
from covista_service.workers.jobs import Job
from covista_service.workers.pool import DEADLINE_S, TRIES, JobLostError, Tally, cancelled
from covista_service.workers.processes import Processes
from covista_service.workers.scheduler import SCHEME
from covista_service.workers.threads import Threads

if TYPE_CHECKING:
    from distributed import Client

_CONNECT_S, _CLOSE_S, _END_S = 5.0, 3.0, 8.0
# Between attempts to connect, the first time and at most.
_PAUSE_S, _LONGEST_PAUSE_S = 0.5, 10.0
# Dask tells the world of each connection that it loses; what matters is said here.
_LOGGERS = ("distributed", "distributed.client", "distributed.core", "distributed.batched", "distributed.comm")
_T = TypeVar("_T")

log = logging.getLogger(__name__)


class Cluster:
    """A Dask cluster, with an asyncio loop of its own in a thread of its own: `submit` never waits.

    While the scheduler is away or has no workers, `count` threads here do the jobs, and it is looked for again and
    again. A job that a worker died of is tried at another; where there is none, and where none answered in time, in a
    process here, that nothing depends on. A worker that did not answer in time has no jobs until it does.
    """

    def __init__(self, scheduler: str, count: int, *, deadline_s: float = DEADLINE_S) -> None:
        self._scheduler = scheduler
        self._count = count
        self._deadline_s = deadline_s
        self._tally = Tally()
        self._threads = Threads(count)
        self._aside: Processes | None = None
        self._lock = threading.Lock()
        self._closed = False
        self._connection: Connection | None = None
        self._why_away = "connecting"
        self._begun = threading.Event()
        self._asyncio: asyncio.AbstractEventLoop
        self._main: asyncio.Task[None]
        self._thread = threading.Thread(target=self._run, name="covista-cluster", daemon=True)
        self._thread.start()
        self._begun.wait()

    def submit(self, job: Job[_T]) -> Future[_T]:
        """Have a job done; its future fails with what the job raises, or with JobLostError."""
        with self._lock:
            if self._closed:
                return cancelled()
            if self._connection is None:
                return self._threads.submit(job)
            return asyncio.run_coroutine_threadsafe(self._do(job), self._asyncio)

    def status(self) -> CrewStatus:
        """Who is there now, and what has happened since the start."""
        connection, url = self._connection, f"{SCHEME}{self._scheduler}"
        capacity = 0 if connection is None else connection.capacity
        unfit = "" if connection is None else "; ".join(f"{one} {why}" for one, why in connection.unfit.items())
        if capacity:
            return self._tally.on(CrewStatus("dask", capacity, remark=unfit or None))
        if connection is None:
            said = f"{url} is away ({self._why_away})"
        elif connection.greeting:
            said = f"workers of {url} are loading compiled code"
        else:
            said = f"{url} has no workers" + (f" of use: {unfit}" if unfit else "")
        return self._tally.on(CrewStatus("dask", self._count, fallback=f"{said}: {self._count} threads here"))

    def close(self) -> None:
        """Drop jobs at the cluster, let those here end, and let go of the cluster."""
        with self._lock:
            self._closed = True
        ends_s = time.monotonic() + _END_S
        while self._thread.is_alive() and time.monotonic() < ends_s:
            # More than once, for what waits in libraries may take it for something else.
            with suppress(RuntimeError):
                self._asyncio.call_soon_threadsafe(self._main.cancel)
            self._thread.join(1.0)
        if self._thread.is_alive():
            log.warning("the connection with %s%s does not end", SCHEME, self._scheduler)
        self._threads.close()
        if self._aside is not None:
            self._aside.close()

    def _run(self) -> None:
        with asyncio.Runner() as runner, suppress(asyncio.CancelledError):
            runner.run(self._until_closed())

    async def _until_closed(self) -> None:
        self._asyncio = asyncio.get_running_loop()
        self._asyncio.set_exception_handler(_left_behind)
        self._main = asyncio.create_task(self._keep())
        self._begun.set()
        await self._main

    async def _keep(self) -> None:
        """Be connected, again and again."""
        pause_s = _PAUSE_S
        while not self._closed:
            try:
                client = await self._connect()
            except Exception as error:  # noqa: BLE001 - whatever it is, it is told, and tried again
                self._note_away(_why(error))
                await asyncio.sleep(pause_s)
                pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
                continue
            pause_s = _PAUSE_S
            await self._use(client)

    async def _connect(self) -> Client:
        from distributed import Client

        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL)
        await self._probe()
        client: Client = Client(
            f"tcp://{self._scheduler}", asynchronous=True, set_as_default=False, timeout=_CONNECT_S, name="covista"
        )
        connected = asyncio.ensure_future(client)
        try:
            await asyncio.shield(connected)
        except BaseException:
            # A client that is given up half-way leaves things undone.
            await asyncio.wait([connected], timeout=2 * _CONNECT_S)
            await _close(client)
            raise
        return client

    async def _probe(self) -> None:
        """Is anybody there who speaks first, as a scheduler does? Dask makes much ado about an address without."""
        host, _, port = self._scheduler.rpartition(":")
        async with asyncio.timeout(_CONNECT_S):
            reader, writer = await asyncio.open_connection(host.strip("[]"), int(port))
            try:
                await reader.readexactly(1)
            finally:
                writer.close()

    async def _use(self, client: Client) -> None:
        """Send jobs to a cluster until it is away."""
        connection = Connection(client, self._tally, self._deadline_s)
        try:
            why = await self._unlike(client)
            if why is None:
                self._connection = connection
                log.info("connected with %s%s", SCHEME, self._scheduler)
                why = await connection.watch()
            self._note_away(why)
        finally:
            self._connection = None
            connection.leave()
            await _close(client)

    async def _unlike(self, client: Client) -> str | None:
        """What is wrong with the scheduler's software: it reads what jobs are."""
        try:
            return unlike(await client.run_on_scheduler(version, "covista"))
        except Exception as error:  # noqa: BLE001 - the scheduler hands on whatever it met
            return unlike(error)

    def _note_away(self, why: str) -> None:
        if why != self._why_away and not self._closed:
            log.warning("%s%s is away (%s); %d threads here", SCHEME, self._scheduler, why, self._count)
        self._why_away = why

    async def _do(self, job: Job[_T]) -> _T:
        tried: list[Post] = []
        while len(tried) < TRIES and (connection := self._connection) is not None:
            post = connection.choose(tried)
            if post is None:
                break
            try:
                return await connection.run(job, post)
            except OverdueError:
                why = f"did not answer within {self._deadline_s:g} s"
                log.warning("worker %s %s", post.address, why)
                connection.doubt(post, why)
                self._tally.note("overdue")
                self._tally.note("retried")
                return await self._do_aside(job)
            except PostLostError:
                self._tally.note("retried")
                if not connection.away:
                    tried.append(post)
        if not tried:
            return await asyncio.wrap_future(self._threads.submit(job))
        if len(tried) < TRIES:
            return await self._do_aside(job)
        self._tally.note("given_up")
        raise JobLostError(f"workers died of it: {', '.join(post.address for post in tried)}")

    async def _do_aside(self, job: Job[_T]) -> _T:
        """Do what may kill, or never return, in a process here."""
        if self._aside is None:
            # Each that comes meanwhile waits for the same one.
            self._aside = Processes(1, deadline_s=self._deadline_s, tally=self._tally)
        return await asyncio.wrap_future(self._aside.submit(job))


def _left_behind(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """What nobody waits for any more: of a connection that is lost, Dask leaves tasks behind that end by exceptions."""
    error = context.get("exception")
    if error is not None and type(error).__module__.partition(".")[0] == "distributed":
        log.debug("left behind by Dask: %r", error)
    else:
        loop.default_exception_handler(context)


def _why(error: Exception) -> str:
    """In a few words, why there is no connection."""
    if isinstance(error, OSError) and error.errno is not None:
        return os.strerror(error.errno).lower()
    return str(error).partition("\n")[0] or "no answer"


async def _close(client: Client) -> None:
    with suppress(Exception):
        async with asyncio.timeout(_CLOSE_S):
            await client.close()
