"""Who has logged in with a token, in a browser: a session ends with its token, with time, or with the station.

They are kept in memory alone. A session that outlived the station would have to be stored, or signed with something
that is stored beside the digests of tokens: then whoever reads the database could make one up.
"""

from __future__ import annotations

import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from hashlib import blake2b

from covista_service.access.scopes import Scopes
from covista_service.access.tokens import Token

# What a browser shows of a session.
COOKIE = "covista_session"
# Not used for so long, or begun so long ago: log in again.
IDLE_S, LONGEST_S = 24 * 3600.0, 30 * 24 * 3600.0
# Of more the one that was not used for longest goes.
MOST = 1024
_RANDOM_BYTES = 32


@dataclass(frozen=True, slots=True)
class Session:
    """Whose token it was and which, what that allows, and when the session began and was used last."""

    name: str
    digest: str = field(repr=False)
    scopes: Scopes
    begun_s: float
    used_s: float


class Sessions:
    """Sessions by the digest of what the browser shows; for one thread."""

    def __init__(self, *, most: int = MOST, clock: Callable[[], float] = time.monotonic) -> None:
        self._most = most
        self._clock = clock
        self._open: OrderedDict[bytes, Session] = OrderedDict()

    def __len__(self) -> int:
        return len(self._open)

    def begin(self, token: Token) -> str:
        """A session of who has this token: what the browser is to show."""
        secret, now_s = secrets.token_urlsafe(_RANDOM_BYTES), self._clock()
        self._open[_digest(secret)] = Session(token.name, token.digest, token.scopes, now_s, now_s)
        while len(self._open) > self._most:
            self._open.popitem(last=False)
        return secret

    def find(self, secret: str) -> Session | None:
        """The session that this is, which is used with that."""
        # Found by its digest: how long that takes tells nothing of secrets.
        key, now_s = _digest(secret), self._clock()
        found = self._open.pop(key, None)
        if found is None or self._is_over(found, now_s):
            return None
        self._open[key] = used = replace(found, used_s=now_s)
        return used

    def peek(self, secret: str) -> Session | None:
        """The session that this is; to look is no use of it."""
        found = self._open.get(_digest(secret))
        return None if found is None or self._is_over(found, self._clock()) else found

    def end(self, secret: str) -> None:
        """Log out."""
        self._open.pop(_digest(secret), None)

    def _is_over(self, session: Session, now_s: float) -> bool:
        return now_s - session.used_s > IDLE_S or now_s - session.begun_s > LONGEST_S


def _digest(secret: str) -> bytes:
    return blake2b(secret.encode(), digest_size=32).digest()
