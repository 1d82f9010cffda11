"""The tokens in memory, so that no request waits for a database."""

from __future__ import annotations

import time
from collections.abc import Sequence
from enum import Enum

from covista_service.access import tokens
from covista_service.access.tokens import Token

# The last use is stored no more finely than this.
USE_US = 60_000_000


class Door(Enum):
    """Whether tokens are asked for: they are where there is one, or was; nobody is let in before that is known."""

    UNKNOWN = "unknown"
    OPEN = "open"
    LOCKED = "locked"


class Keyring:
    """What is known of tokens; `take` in one thread, all else in any.

    Revoking keeps a row, so tokens whose rows are gone (the database was deleted, or another one is in its place) go on
    until the station restarts, and so does having been revoked. With `locked` tokens are asked for even without any.
    """

    def __init__(self, *, locked: bool = False) -> None:
        self._locked = locked
        self._known: dict[str, Token] = {}
        self._door = Door.UNKNOWN
        self._used_us: dict[str, int] = {}
        self._noted_us: dict[str, int] = {}
        self._taken_s = time.monotonic()

    @property
    def door(self) -> Door:
        """Whether a token is needed."""
        return self._door

    @property
    def age_s(self) -> float:
        """How long ago the tokens were read."""
        return time.monotonic() - self._taken_s

    @property
    def live(self) -> int:
        """How many tokens let somebody in."""
        return sum(token.revoked_us is None for token in self._known.values())

    def lets_in(self, name: str | None) -> bool:
        """Whether who came with the token of this name, or with none, would still be let in."""
        if name is None:
            return self._door is Door.OPEN
        return any(token.name == name and token.revoked_us is None for token in self._known.values())

    def is_live(self, digest: str) -> bool:
        """Whether the token of this digest lets somebody in."""
        token = self._known.get(digest)
        return token is not None and token.revoked_us is None

    def take(self, found: Sequence[Token]) -> None:
        """All tokens, as they were read just now."""
        known = dict(self._known)
        for token in found:
            before = known.get(token.digest)
            if before is None or before.revoked_us is None:
                known[token.digest] = token
        # One assignment: who looks in another thread sees the old or the new.
        self._known = known
        self._door = Door.LOCKED if known or self._locked else Door.OPEN
        self._taken_s = time.monotonic()

    def find(self, secret: str) -> Token | None:
        """The token that this is, perhaps a revoked one."""
        return tokens.find(secret, tuple(self._known.values()))

    def used(self, name: str) -> None:
        """Somebody was let in with the token of this name."""
        self._used_us[name] = time.time_ns() // 1000

    def uses(self, *, least_us: int = USE_US) -> dict[str, int]:
        """Tokens that were used so much later than was last `noted`, by name, and when."""
        used = self._used_us.copy()
        return {name: at_us for name, at_us in used.items() if at_us - self._noted_us.get(name, 0) > least_us}

    def noted(self, uses: dict[str, int]) -> None:
        """These uses are stored."""
        self._noted_us |= uses
