"""Jobs in processes of their own."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any, ParamSpec, TypeVar

from covista_service.loop import CrewStatus
from covista_service.perception.camera import Features
from covista_service.workers.arena import Arena, Slip
from covista_service.workers.child import Child
from covista_service.workers.jobs import Job, unpacked
from covista_service.workers.pool import DEADLINE_S, TRIES, JobLostError, Tally
from covista_service.workers.shipped import Shipped

# When the pool closes, jobs under way get so long to end.
_GRACE_S = 2.0
_P = ParamSpec("_P")
_T = TypeVar("_T")

log = logging.getLogger(__name__)


class Processes:
    """`count` processes, each beside a thread that waits for it.

    The death of one costs one job, which is done again by the next that is free. What did not answer within
    `deadline_s` is killed, and its job done again likewise. A job that this happens to twice is given up.
    """

    def __init__(self, count: int, *, deadline_s: float = DEADLINE_S, tally: Tally | None = None) -> None:
        """Raises OSError where processes cannot be started."""
        self._count = count
        self._deadline_s = deadline_s
        self._tally = tally or Tally()
        self._lock = threading.Lock()
        self._closing = False
        self._arena = _arena()
        self._shipped: Shipped[Slip] = Shipped()
        # As many as threads: whoever wants one finds one.
        self._living: list[Child] = []
        self._idle: deque[Child] = deque()
        self._threads = ThreadPoolExecutor(count, "covista-worker")
        self._under_way: set[Future[Any]] = set()
        try:
            self._idle.extend(self._child() for _ in range(count))
            self._loading = [self._start(self._meet) for _ in range(count)]
        except BaseException:
            self.close()
            raise

    def submit(self, job: Job[_T]) -> Future[_T]:
        """Have a job done. Raises RuntimeError where the pool is closed."""
        return self._start(self._do, job)

    def status(self) -> CrewStatus:
        """How many, and what has happened to them."""
        return self._tally.on(CrewStatus("processes", self._count, all(one.done() for one in self._loading)))

    def close(self) -> None:
        """Let jobs under way end, within reason, and drop those that wait."""
        self._closing = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        for child in self._family():
            if child.loading:
                child.kill()
        if wait(list(self._under_way), _GRACE_S).not_done:
            for child in self._family():
                child.kill()
        self._threads.shutdown(wait=True)
        for child in self._idle:
            child.end()
        if self._arena is not None:
            self._arena.close()

    def _start(self, do: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        future = self._threads.submit(do, *args, **kwargs)
        self._under_way.add(future)
        future.add_done_callback(self._under_way.discard)
        return future

    def _meet(self) -> None:
        """Wait until one more process is ready."""
        child = self._idle.popleft()
        try:
            child.shares()
        except (EOFError, TimeoutError):
            if not self._closing:
                log.warning("a worker could not load compiled code; it is replaced when a job comes")
        finally:
            self._idle.append(child)

    def _do(self, job: Job[_T]) -> _T:
        packed = job.packed()
        for left in reversed(range(TRIES)):
            said = self._try(job, packed)
            if said is not None:
                result: _T = unpacked(said)
                return result
            if self._closing:
                raise JobLostError("the station ends")
            if left:
                self._tally.note("retried")
        self._tally.note("given_up")
        raise JobLostError(f"{TRIES} workers died of it, or did not return within {self._deadline_s:g} s")

    def _try(self, job: Job[_T], packed: bytes) -> bytes | None:
        """What the next process that is free says to a job, None if it did not live to say anything."""
        child = self._next()
        try:
            if child.ended:
                return None
            # Loading compiled code is not the job's time.
            place = self._shared if child.shares() else self._by_value
            features = [place(one) for one in job.features]
            return child.ask(packed, features, self._deadline_s)
        except TimeoutError:
            self._tally.note("overdue")
            log.warning("a job did not return within %g s; its worker is replaced", self._deadline_s)
            child = self._after(child)
        except EOFError:
            log.warning("a worker died; another takes its place")
            child = self._after(child)
        finally:
            self._idle.append(child)
        return None

    def _next(self) -> Child:
        """The next process that is free, an ended one where none lives and none can be started."""
        child = self._idle.popleft()
        for _ in range(self._count):
            if not child.alive:
                child = self._after(child)
            if not child.ended:
                break
            self._idle.append(child)
            child = self._idle.popleft()
        return child

    def _after(self, child: Child) -> Child:
        """Another process in the place of one that is of no use; that one, ended, where no other can be started."""
        if not child.ended:
            child.end()
            if not self._closing:
                self._tally.note("lost")
        if self._closing:
            return child
        try:
            return self._child()
        except OSError as error:
            log.warning("no worker can be started: %s", error)
            return child

    def _child(self) -> Child:
        child = Child(None if self._arena is None else self._arena.path)
        with self._lock:
            self._living = [one for one in self._living if one.alive] + [child]
        return child

    def _family(self) -> list[Child]:
        with self._lock:
            return list(self._living)

    def _shared(self, features: Features) -> Slip | Features:
        """Where features lie that all processes see; themselves where there is no room."""
        if self._arena is None:
            return self._by_value(features)
        with self._lock:
            slip = self._shipped.find(features)
            for gone in self._shipped.released():
                self._arena.free(gone)
            if slip is None and (slip := self._arena.put(features)) is not None:
                self._shipped.add(features, slip)
                self._tally.note("shipped_bytes", slip.size)
        return slip or self._by_value(features)

    def _by_value(self, features: Features) -> Slip | Features:
        self._tally.note("shipped_bytes", features.keypoints_px.nbytes + features.descriptors.nbytes)
        return features


def _arena() -> Arena | None:
    try:
        return Arena()
    except (AttributeError, OSError) as error:
        log.info("features travel with each job, for processes cannot share memory here: %s", error)
        return None
