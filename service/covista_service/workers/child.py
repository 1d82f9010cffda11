"""A worker process, and the station's line to it."""

from __future__ import annotations

import os
import pickle
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection

from covista_service.perception.camera import Features
from covista_service.workers.arena import Lent, Slip
from covista_service.workers.jobs import begin_to_work, load, perform
from covista_service.workers.pool import LOADING_S

_END_S = 5.0
_SHARES, _ALONE = b"shares", b"alone"


class Child:
    """A process that does one job at a time."""

    def __init__(self, arena: str | None) -> None:
        """Start it, and go on while it loads compiled code; `arena` is where to find the features that are shared.

        Raises OSError where no process can be started.
        """
        spawn = get_context("spawn")
        self._line, theirs = spawn.Pipe()
        self._process = spawn.Process(target=_work, args=(theirs, arena), name="covista-worker", daemon=True)
        try:
            self._process.start()
        except OSError:
            self._line.close()
            raise
        finally:
            theirs.close()
        self._shares: bool | None = None
        self.ended = False

    @property
    def alive(self) -> bool:
        """Has it not died?"""
        return self._process.is_alive()

    @property
    def loading(self) -> bool:
        """Is it not known to be ready for a job?"""
        return self._shares is None

    def shares(self) -> bool:
        """Does it see the shared features? Waits until it is ready. Raises EOFError if it died, or TimeoutError."""
        if self._shares is None:
            self._shares = self._hear(LOADING_S) == _SHARES
        return self._shares

    def ask(self, packed: bytes, features: list[Features | Slip], deadline_s: float) -> bytes:
        """Have a job done. Raises EOFError if the process died, TimeoutError if it does not answer."""
        try:
            self._line.send_bytes(pickle.dumps((packed, features), 5))
        except OSError as error:
            raise EOFError from error
        return self._hear(deadline_s)

    def end(self) -> None:
        """End it, whatever it does: it holds nothing that would be left."""
        self.ended = True
        self._process.kill()
        self._process.join(_END_S)
        self._line.close()

    def kill(self) -> None:
        """End what it does; whoever waits for its answer hears that it died."""
        self._process.kill()

    def _hear(self, deadline_s: float) -> bytes:
        try:
            if self._line.poll(deadline_s):
                return self._line.recv_bytes()
        except OSError as error:
            raise EOFError from error
        raise TimeoutError


def _work(line: Connection, arena: str | None) -> None:
    """What the process does, from its start to its end."""
    # Ctrl-C is left to the station, and a station that is killed takes its workers along.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    station = parent_process()
    if station is not None:
        threading.Thread(target=_follow, args=(station.join,), daemon=True).start()
    begin_to_work()
    lent = _lent(arena)
    load()
    with suppress(EOFError, OSError):
        line.send_bytes(_ALONE if lent is None else _SHARES)
        while True:
            line.send_bytes(_perform(line.recv_bytes(), lent))


def _perform(message: bytes, lent: Lent | None) -> bytes:
    packed, features = pickle.loads(message)  # noqa: S301 - from our own station
    return perform(packed, [lent.features(one) if lent and isinstance(one, Slip) else one for one in features])


def _lent(arena: str | None) -> Lent | None:
    try:
        return None if arena is None else Lent(arena)
    except OSError:
        return None


def _follow(wait: Callable[[], None]) -> None:
    wait()
    os._exit(1)
