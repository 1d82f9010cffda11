"""Whether somebody may do something: tokens, scopes and failures together, without a word of HTTP."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from enum import StrEnum

from covista_service.access.attempts import Attempts
from covista_service.access.keyring import Door, Keyring
from covista_service.access.scopes import Scope, covers
from covista_service.access.sessions import Sessions
from covista_service.access.tokens import Token, is_shaped
from covista_service.telemetry import about

_SCHEME = "bearer"

log = logging.getLogger(__name__)


class Refusal(StrEnum):
    """Why somebody is not let in."""

    MISSING = "missing"
    MALFORMED = "malformed"
    UNKNOWN = "unknown"
    REVOKED = "revoked"
    # What a browser shows is no session any more.
    SESSION = "session"
    # A browser was told to ask by a page of somebody else.
    ORIGIN = "origin"
    SCOPE = "scope"
    LIMITED = "limited"
    # The tokens themselves are not known yet.
    UNREAD = "unread"
    # A name for this machine that is none of its own, where everybody is let in.
    HOST = "host"


@dataclass(frozen=True, slots=True)
class Admitted:
    """Come in; `by` is the name of the token, None where none is needed."""

    by: str | None = None


@dataclass(frozen=True, slots=True)
class Refused:
    """Stay out; where there were too many failures, for so long."""

    reason: Refusal
    retry_after_s: int = 0


Answer = Admitted | Refused


async def _no_news() -> None:
    """Nobody reads tokens again."""


class Gate:
    """Lets in who has a token for what is wanted; `refused` counts all others by reason.

    `news` waits for tokens that were made a moment ago. With `any_host` requests may call this machine what they like
    where no token is needed.
    """

    def __init__(
        self,
        keyring: Keyring,
        attempts: Attempts | None = None,
        *,
        news: Callable[[], Awaitable[None]] = _no_news,
        any_host: bool = False,
    ) -> None:
        self.keyring = keyring
        self.any_host = any_host
        self._news = news
        self._attempts = Attempts() if attempts is None else attempts
        self.sessions = Sessions()
        self.refused: Counter[str] = Counter({str(reason): 0 for reason in Refusal})

    async def admit(self, credentials: list[str], wanted: Scope, address: str) -> Admitted | Refused:
        """Judge who shows these credentials (the values of all Authorization headers) and asks from `address`."""
        door = self.keyring.door
        if door is Door.OPEN:
            return Admitted()
        if door is Door.UNKNOWN:
            return self.refuse(Refusal.UNREAD, address)
        found = await self._identify(credentials)
        if isinstance(found, Refusal):
            retry_after_s = self._attempts.fail(address)
            return self.refuse(Refusal.LIMITED if retry_after_s else found, address, retry_after_s)
        if not covers(found.scopes, wanted):
            return self.refuse(Refusal.SCOPE, address, by=found.name)
        self.keyring.used(found.name)
        return Admitted(found.name)

    def admit_session(self, secret: str, wanted: Scope, address: str) -> Admitted | Refused:
        """Judge who shows what `log_in` gave, or nothing. That is no failure: nobody guesses 256 bits."""
        door = self.keyring.door
        if door is Door.OPEN:
            return Admitted()
        if door is Door.UNKNOWN:
            return self.refuse(Refusal.UNREAD, address)
        session = self.sessions.find(secret)
        if session is None or not self.keyring.is_live(session.digest):
            # It ends with its token.
            self.sessions.end(secret)
            return self.refuse(Refusal.SESSION if secret else Refusal.MISSING, address)
        if not covers(session.scopes, wanted):
            return self.refuse(Refusal.SCOPE, address, by=session.name)
        self.keyring.used(session.name)
        return Admitted(session.name)

    def holds(self, secret: str) -> bool:
        """Whether who showed this would still be let in; to look is no use of a session."""
        if self.keyring.door is Door.OPEN:
            return True
        session = self.sessions.peek(secret)
        return session is not None and self.keyring.is_live(session.digest)

    async def log_in(self, secret: str, address: str) -> str | Refused:
        """A session for who has a token to read with: what the browser is to show from now on.

        Empty where no token is needed.
        """
        admitted = await self.admit([f"{_SCHEME} {secret}"], Scope.READ, address)
        if isinstance(admitted, Refused):
            return admitted
        token = self.keyring.find(secret)
        return "" if token is None else self.sessions.begin(token)

    def refuse(self, reason: Refusal, address: str, retry_after_s: int = 0, by: str | None = None) -> Refused:
        """Count and log a refusal; what was shown is no part of it."""
        self.refused[reason] += 1
        log.warning("refused", extra=about(reason=str(reason), address=address, by=by))
        return Refused(reason, retry_after_s)

    async def _identify(self, credentials: list[str]) -> Token | Refusal:
        if not credentials:
            return Refusal.MISSING
        scheme, _, secret = credentials[0].partition(" ")
        secret = secret.strip(" ")
        if len(credentials) > 1 or scheme.lower() != _SCHEME or not secret:
            return Refusal.MALFORMED
        if not is_shaped(secret):
            return Refusal.UNKNOWN
        token = self.keyring.find(secret)
        if token is None:
            # It may have been made a moment ago.
            await self._news()
            token = self.keyring.find(secret)
        if token is None:
            return Refusal.UNKNOWN
        return token if token.revoked_us is None else Refusal.REVOKED
