"""A connection to a Dask scheduler, for as long as it holds. All of it runs in one asyncio loop.

Dask brings bytes to where they are needed and knows who is there. Which worker does a job is said here, so that it is
known who died of what.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import pickle
from collections.abc import Awaitable, Collection
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, TypeVar, cast

from covista_service.perception.camera import Features
from covista_service.workers.jobs import Job, loading, perform, unpacked
from covista_service.workers.pool import DEADLINE_S, LOADING_S, Tally
from covista_service.workers.shipped import Shipped

if TYPE_CHECKING:
    from distributed import Client, Future

# To and from a worker a job takes some 20 ms, longer than most are worked at: as many are on their way as are done.
_ON_THE_WAY = 2
# Dask tells who comes and goes; who is there is asked besides, every so often, and the answer comes within so long.
_LOOK_S, _ANSWER_S = 1.0, 5.0
_DISTRIBUTION = "covista"
_T = TypeVar("_T")

log = logging.getLogger(__name__)


class PostLostError(Exception):
    """The worker that had a job, or the way to it, is gone."""


class OverdueError(Exception):
    """A worker did not answer in time."""


@dataclass(slots=True, eq=False)
class Post:
    """A Dask worker: it does `slots` jobs at a time, and has `load` of ours; `gone` is set when it is no more."""

    address: str
    slots: int
    load: int = 0
    gone: asyncio.Event = field(default_factory=asyncio.Event)


class Connection:
    """What goes on between the station and a cluster."""

    def __init__(self, client: Client, tally: Tally, deadline_s: float = DEADLINE_S) -> None:
        self._client = client
        self._tally = tally
        self._deadline_s = deadline_s
        self._stir = asyncio.Event()
        self._present: dict[str, Post] = {}
        self._greeting: dict[str, asyncio.Task[None]] = {}
        self._shipped: Shipped[Future[bytes]] = Shipped()
        self._numbers = itertools.count()
        self.away = False
        # Those that jobs may go to, and why not to others, by address; replaced whole, for other threads to read.
        self.posts: tuple[Post, ...] = ()
        self.unfit: dict[str, str] = {}

    @property
    def capacity(self) -> int:
        """How many jobs keep the cluster busy: those that it does, and as many on their way."""
        return _ON_THE_WAY * sum(post.slots for post in self.posts)

    @property
    def greeting(self) -> bool:
        """Are there workers that are not ready yet?"""
        return any(address not in self.unfit for address in self._greeting)

    def choose(self, tried: Collection[Post]) -> Post | None:
        """The worker with most room, but none of those that have been tried."""
        able = [post for post in self.posts if not any(post is one for one in tried)]
        return min(able, key=lambda post: (post.load - post.slots, post.load), default=None)

    async def run(self, job: Job[_T], post: Post) -> _T:
        """Have a worker do a job. Raises what the job raises, or PostLostError, or OverdueError."""
        result: _T = unpacked(await self._perform(job, post, self._deadline_s))
        return result

    def doubt(self, post: Post, why: str) -> None:
        """Give no more jobs to a worker that did not answer, nor wait for those that it has, until it answers again."""
        if self._present.get(post.address) is not post:
            return
        post.gone.set()
        self.posts = tuple(one for one in self.posts if one is not post)
        self.unfit = {**self.unfit, post.address: why}
        again = self._present[post.address] = Post(post.address, post.slots)
        self._greeting[post.address] = asyncio.create_task(self._greet_again(again))

    async def watch(self) -> str:
        """Keep to who is there, until the scheduler is not; why it is not."""
        why = "connection lost"
        self._client.subscribe_topic("all", lambda _: self._stir.set())
        while not self._cut_off():
            try:
                async with asyncio.timeout(_ANSWER_S):
                    threads = await self._client.nthreads()
            except Exception as error:  # noqa: BLE001 - no answer is an answer
                why = f"does not say who is there: {error or type(error).__name__}"
                break
            self._meet(threads)
            with suppress(TimeoutError):
                async with asyncio.timeout(_LOOK_S):
                    await self._stir.wait()
            self._stir.clear()
        self.leave()
        return why

    def leave(self) -> None:
        """Expect nothing any more; jobs under way hear of it."""
        self.away = True
        self._stir.set()
        for task in self._greeting.values():
            task.cancel()
        for post in self._present.values():
            post.gone.set()
        self.posts = ()

    def _cut_off(self) -> bool:
        return self.away or self._client.status != "running"

    def _meet(self, threads: dict[str, int]) -> None:
        """Part with workers that are gone, and greet those that are new."""
        for address in [address for address in self._present if address not in threads]:
            self._present.pop(address).gone.set()
            self.unfit = {other: why for other, why in self.unfit.items() if other != address}
            self._part(address)
        for address, slots in threads.items():
            if address not in self._present:
                post = self._present[address] = Post(address, slots)
                self._greeting[address] = asyncio.create_task(self._greet(post))

    def _part(self, address: str) -> None:
        greeting = self._greeting.pop(address, None)
        if greeting is not None:
            greeting.cancel()
        self.posts = tuple(post for post in self.posts if post.address != address)
        self._tally.note("lost")
        log.warning("worker %s is gone; %d left", address, len(self.posts))

    async def _greet(self, post: Post) -> None:
        """Give no job to a worker before it has the same software, and compiled code loaded."""
        try:
            why = await self._unlike(post.address)
            if why is None:
                unpacked(await self._perform(loading(), post, LOADING_S))
                self.posts = (*self.posts, post)
                log.info("worker %s is ready, one of %d", post.address, len(self.posts))
        except Exception as error:  # noqa: BLE001 - told to whoever asks for the health
            why = f"cannot be used: {error or type(error).__name__}"
        if why is not None and not self.away:
            log.warning("worker %s %s", post.address, why)
            self.unfit = {**self.unfit, post.address: why}
        self._greeting.pop(post.address, None)

    async def _greet_again(self, post: Post) -> None:
        """Wait until a worker that did not answer does, however long that takes."""
        while self._present.get(post.address) is post:
            try:
                unpacked(await self._perform(loading(), post, LOADING_S))
            except Exception:  # noqa: BLE001 - why it is not used is told already
                await asyncio.sleep(_LOOK_S)
                continue
            log.info("worker %s answers again", post.address)
            self.unfit = {other: why for other, why in self.unfit.items() if other != post.address}
            self.posts = (*self.posts, post)
            break
        self._greeting.pop(post.address, None)

    async def _unlike(self, address: str) -> str | None:
        """What is wrong with a worker's software."""
        answers = await self._client.run(version, _DISTRIBUTION, workers=[address], on_error="return")
        return unlike(answers[address])

    async def _perform(self, job: Job[Any], post: Post, deadline_s: float) -> bytes:
        packed = job.packed()
        post.load += 1
        try:
            features = [self._ship(one, post) for one in job.features]
            there = self._client.submit(
                perform_there, packed, features, key=self._name("job"), workers=[post.address], pure=False
            )
        except Exception as error:
            post.load -= 1
            raise PostLostError from error
        try:
            return await self._answer(there, post, deadline_s)
        finally:
            post.load -= 1
            there.release()

    async def _answer(self, there: Future[bytes], post: Post, deadline_s: float) -> bytes:
        answer, gone = (
            asyncio.ensure_future(cast(Awaitable[bytes], there.result())),
            asyncio.ensure_future(post.gone.wait()),
        )
        try:
            await asyncio.wait({answer, gone}, timeout=deadline_s, return_when=asyncio.FIRST_COMPLETED)
            if answer.done() and not answer.cancelled():
                said: bytes = answer.result()
                return said
        except Exception as error:
            # The job's own errors come as bytes: this is Dask's.
            if self._client.status != "running":
                self.leave()
            raise PostLostError from error
        finally:
            ended = gone.done() or answer.done()
            _forget(answer)
            _forget(gone)
        if ended:
            raise PostLostError
        raise OverdueError

    def _ship(self, features: Features, post: Post) -> Future[bytes]:
        """Features at the cluster: the scheduler keeps the bytes, and brings them to whoever lacks them."""
        shipped = self._shipped.find(features)
        for future in self._shipped.released():
            future.release()
        if shipped is not None and shipped.status in ("pending", "finished"):
            return shipped
        if shipped is not None:
            self._tally.note("shipped_again")
        data = pickle.dumps(features, 5)
        self._tally.note("shipped_bytes", len(data))
        # Any worker can do this job: the bytes come back as they are.
        future = self._client.submit(
            bytes, data, key=self._name("features"), workers=[post.address], allow_other_workers=True, pure=False
        )
        self._shipped.add(features, future)
        return future

    def _name(self, what: str) -> str:
        return f"covista-{what}-{self._client.id}-{next(self._numbers)}"


def unlike(found: object) -> str | None:
    """How software that was found differs from ours: a version, or the error that there is none."""
    ours = version(_DISTRIBUTION)
    if isinstance(found, str):
        return None if found == ours else f"has {_DISTRIBUTION} {found}, not {ours}"
    return f"has no {_DISTRIBUTION}"


def perform_there(packed: bytes, features: list[bytes]) -> bytes:
    """At a Dask worker: do a job with features that were shipped."""
    return perform(packed, [pickle.loads(each) for each in features])  # noqa: S301 - from our own station


def _forget(waiting: asyncio.Future[Any]) -> None:
    """Expect nothing of it any more, and let nobody miss its error."""
    waiting.cancel()
    waiting.add_done_callback(lambda done: done.cancelled() or done.exception())
