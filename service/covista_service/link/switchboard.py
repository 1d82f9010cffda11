"""The station's session, and what is plugged into it: when others are to be let in, a new session takes its place.

Zenoh reads who may do what when a session opens. So where the list of robots or a certificate changes, the session
alone is closed and opened again: subscriptions, publishers and answers move over, and robots connect by themselves.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Collection, Sequence
from typing import Any

import zenoh
from covista_schemas.errors import LinkError

from covista_service.link.admission import Admission, Lock
from covista_service.link.session import open_session, try_certificates
from covista_service.link.strangers import Strangers
from covista_service.telemetry import about

# How often the files and the links are looked at.
EVERY_S = 0.5
# After so long without a router a client takes another id: a router lets nobody in whose id somebody has already, and
# who has taken it may be a robot with a certificate.
ALONE_S = 5.0
_CLOSE_S = 10.0

# Opens a session for those who are let in; None: everybody is.
Open = Callable[[Admission | None], zenoh.Session]
Part = Callable[[], object]
# Takes up a session, and returns how to let go of it.
Join = Callable[[zenoh.Session], Part]

log = logging.getLogger(__name__)


def opening(listen: Sequence[str], connect: Sequence[str], site: str, lock: Lock | None) -> Open:
    """How a station or a router opens its session. Who only joins asks nobody in, and leaves it to the router."""

    def open_for(admission: Admission | None) -> zenoh.Session:
        access = admission.rules(site) if admission is not None and listen else None
        return open_session(listen, connect, None if lock is None else lock.tls, access)

    return open_for


class Switchboard:
    """Opens a session, and opens it anew when the files of `lock` change. Raises LinkError where it cannot be opened.

    With `waits` it is to join a router: it need not open at once, is tried until it does, and anew when no router has
    answered for a while. `alive` says which robots have a token, None where nobody knows.
    """

    def __init__(
        self,
        open_for: Open,
        lock: Lock | None = None,
        *,
        waits: bool = False,
        alive: Callable[[], Collection[str] | None] = lambda: None,
        every_s: float = EVERY_S,
    ) -> None:
        self.strangers = Strangers()
        self._open = open_for
        self._lock = lock
        self._alive = alive
        self._every_s = every_s
        self._seen = lock.stamp() if lock else ()
        self._taken = self._seen
        self._admission = lock.read() if lock else None
        self._problem: str | None = None
        self._waits = waits
        self._joined_s = time.monotonic()
        if lock:
            try_certificates(lock.tls)
        # Whoever has it may take the session away.
        self._hold = threading.RLock()
        self._joins: dict[object, Join] = {}
        self._parts: dict[object, Part] = {}
        self._session: zenoh.Session | None = None if waits else open_for(self._admission)
        self._changed = threading.Condition()
        self._asked, self._closing = waits, False
        self._thread = threading.Thread(target=self._run, name="covista-link") if lock or waits else None
        if self._thread:
            self._thread.start()

    def plug(self, join: Join) -> Part:
        """Have `join` called with the session, and with each that takes its place; returns how to end that."""
        name = object()
        with self._hold:
            self._joins[name] = join
            if self._session is not None:
                self._parts[name] = join(self._session)
        return lambda: self._unplug(name)

    def renew(self) -> None:
        """Look at the files now, and take up what they say."""
        with self._changed:
            self._asked = True
            self._changed.notify_all()

    @property
    def problem(self) -> str | None:
        """What is not as it should be, in words."""
        return self._problem

    @property
    def joined(self) -> bool:
        """Whether there is a router that we are connected to."""
        return bool(self._ask(lambda session: session.info.routers_zid()))

    @property
    def sessions(self) -> int:
        """How many sessions of others we are connected to."""
        return len(self._ask(lambda session: session.info.transports()))

    def close(self) -> None:
        """Let go of everything."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join(_CLOSE_S)
        with self._hold:
            self._part()

    def _ask(self, question: Callable[[zenoh.Session], list[Any]]) -> list[Any]:
        session = self._session
        try:
            return [] if session is None else question(session)
        except zenoh.ZError:
            # It was closed at that moment.
            return []

    def _unplug(self, name: object) -> None:
        with self._hold:
            self._joins.pop(name, None)
            part = self._parts.pop(name, None)
            if part is not None:
                part()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._asked, self._every_s)
                asked, self._asked = self._asked, False
                if self._closing:
                    return
            try:
                self._look(asked)
            except Exception:
                # A thread that ends would never let a robot in again.
                log.exception("looking after the link failed")

    def _look(self, asked: bool) -> None:
        if self._lock is not None:
            stamp = self._lock.stamp()
            # Not while somebody writes: what has changed is looked at when it has stayed so since the last look.
            settled, self._seen = stamp == self._seen, stamp
            if asked or (settled and stamp != self._taken):
                self._taken = stamp
                self._read(self._lock)
        if self._waits and self._session is not None:
            self._part_if_alone()
        if self._session is None:
            self._reopen()
        if self._lock is not None and self._lock.robots is not None and self._admission is not None:
            self.strangers.look(self._ask(lambda session: session.info.links()), self._admission, self._alive())

    def _read(self, lock: Lock) -> None:
        try:
            admission = lock.read()
            if self._admission is None or admission.digest != self._admission.digest:
                try_certificates(lock.tls)
        except LinkError as error:
            self._problem = f"who is let in stays as it was: {error}"
            log.warning("who is let in on zenoh stays as it was", extra=about(said=str(error)))
            return
        self._problem = None
        if admission == self._admission:
            return
        before = self._admission.robots if self._admission else frozenset()
        come, gone = admission.robots - before, before - admission.robots
        log.info("zenoh opens again for others to be let in", extra=about(come=_some(come), gone=_some(gone)))
        self._problem = "opens again for others to be let in"
        self._admission = admission
        with self._hold:
            self._part()

    def _part_if_alone(self) -> None:
        """Part with a session that has had no router for a while."""
        now_s = time.monotonic()
        if self.joined:
            self._joined_s = now_s
        elif now_s - self._joined_s >= ALONE_S:
            log.warning("no router answers; zenoh opens anew under another id")
            with self._hold:
                self._part()

    def _reopen(self) -> None:
        begun_s = time.monotonic()
        try:
            session = self._open(self._admission)
        except LinkError as error:
            problem = f"cannot open: {error}"
            if problem != self._problem:
                log.warning("zenoh cannot open; tried until it can", extra=about(said=str(error)))
            self._problem = problem
            return
        with self._hold:
            self._session = session
            self._parts = {name: join(session) for name, join in self._joins.items()}
        self._problem = None
        self._joined_s = time.monotonic()
        log.info("zenoh is open; robots connect within seconds", extra=about(s=_seconds(begun_s)))

    def _part(self) -> None:
        for name in reversed(list(self._parts)):
            self._parts.pop(name)()
        session, self._session = self._session, None
        if session is not None:
            session.close()


def _some(robots: Collection[str], most: int = 10) -> str | None:
    named = sorted(robots)
    rest = f" and {len(named) - most} more" if len(named) > most else ""
    return ", ".join(named[:most]) + rest if named else None


def _seconds(begun_s: float) -> str:
    return f"{time.monotonic() - begun_s:.2f}"
