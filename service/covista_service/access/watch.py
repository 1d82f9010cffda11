"""Keeps the keyring as the database has it: reads it every second, and at once when a token comes that is not known.

While the tokens cannot be read, the last ones go on.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from concurrent.futures import Future
from contextlib import suppress

from covista_schemas.reports import PartHealth

from covista_service.access.keyring import USE_US, Door, Keyring
from covista_service.access.tokens import TokenError, TokenSource
from covista_service.telemetry import about

EVERY_S = 1.0
# Strangers make us read no more often than this.
AGAIN_S = 0.2
# So long may who shows a token that is not known wait for news of it.
PATIENCE_S = 0.5
_CLOSE_S = 2.0
_STALE_S = 5.0
_SAID = {
    Door.OPEN: "there are no tokens: open to everybody who can reach it",
    Door.LOCKED: "tokens are required",
    Door.UNKNOWN: "nobody is let in before the tokens are read",
}

log = logging.getLogger(__name__)


class TokenWatch:
    """A thread that reads tokens from `source` into `keyring`, once before this returns; `close` it."""

    def __init__(self, source: TokenSource, keyring: Keyring, *, every_s: float = EVERY_S) -> None:
        self._source = source
        self._keyring = keyring
        self._every_s = every_s
        self._problem: str | None = None
        self._changed = threading.Condition()
        self._asked: list[Future[None]] = []
        self._closing = False
        self._read()
        # Does not keep the process: a database may never answer.
        self._thread = threading.Thread(target=self._run, name="covista-tokens", daemon=True)
        self._thread.start()

    async def news(self) -> None:
        """Wait until the tokens have been read anew, but not for long."""
        read: Future[None] = Future()
        with self._changed:
            if self._closing:
                return
            self._asked.append(read)
            self._changed.notify_all()
        with suppress(TimeoutError):
            await asyncio.wait_for(asyncio.wrap_future(read), PATIENCE_S)

    def health(self) -> PartHealth:
        """Whether tokens are asked for, and whether we hear of new and of revoked ones."""
        said = _SAID[self._keyring.door]
        problem = self._problem
        if problem is None and self._keyring.age_s > _STALE_S:
            problem = "the database of the tokens does not answer"
        if problem is None:
            return PartHealth(status="ready", detail=said)
        return PartHealth(status="degraded", detail=f"{said}; {problem}")

    def close(self) -> None:
        """Stop reading."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(_CLOSE_S)

    def _run(self) -> None:
        closing = False
        while not closing:
            with self._changed:
                begun_s = time.monotonic()
                self._changed.wait_for(lambda: self._closing or self._asked, self._every_s)
                self._changed.wait_for(lambda: self._closing, AGAIN_S - (time.monotonic() - begun_s))
                asked, self._asked = self._asked, []
                closing = self._closing
            if not closing:
                self._read()
            for each in asked:
                # Not where they wait no longer.
                if each.set_running_or_notify_cancel():
                    each.set_result(None)
            self._note_uses(0 if closing else USE_US)

    def _read(self) -> None:
        try:
            self._keyring.take(self._source.read())
        except TokenError as error:
            self._fail(str(error))
        except Exception as error:
            # A thread that ends would go on letting revoked tokens in.
            log.exception("reading tokens failed")
            self._fail(f"tokens cannot be read: {type(error).__name__}")
        else:
            if self._problem is not None:
                log.info("tokens are read again")
            self._problem = None

    def _fail(self, problem: str) -> None:
        if self._problem is None:
            log.warning("tokens cannot be read; those known go on", extra=about(said=problem))
        self._problem = problem

    def _note_uses(self, least_us: int) -> None:
        """It is no harm where they cannot be stored."""
        uses = self._keyring.uses(least_us=least_us)
        if uses:
            with suppress(TokenError):
                self._source.note_uses(uses)
                self._keyring.noted(uses)
