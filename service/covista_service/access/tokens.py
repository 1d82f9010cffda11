"""What a token is, and what is kept of it.

A token is 256 random bits, and only its digest is stored. Slow hashes are for secrets that people think of and others
guess; nobody guesses 256 random bits, whatever the hash costs, so a fast one is enough and each request can afford it.
The key of the digest is a constant of this program, so that digests are worth nothing where others hash tokens. A
secret key would have to be kept beside the database and saved with it, and would help only against who can write
there: to who can read there the digests are useless as it is.
"""

from __future__ import annotations

import hmac
import re
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from typing import Protocol

from covista_schemas.errors import CovistaError

from covista_service.access.scopes import Scopes

# Tells people and scanners of leaked secrets what it is.
PREFIX = "covista_"
_RANDOM_BYTES = 32
_SHAPE = re.compile(rf"{PREFIX}[A-Za-z0-9_-]{{43}}")
_KEY = b"covista station token, version 1"


class TokenError(CovistaError):
    """What was wanted of the tokens cannot be done; the text is one line."""


@dataclass(frozen=True, slots=True)
class Token:
    """What is known of a token; times are microseconds since the epoch."""

    name: str
    digest: str = field(repr=False)
    scopes: Scopes
    created_us: int
    revoked_us: int | None = None
    last_used_us: int | None = None


class TokenSource(Protocol):
    """Where tokens are kept; both calls may wait, and raise TokenError where it is out of reach."""

    def read(self) -> Sequence[Token]:
        """All tokens, revoked ones too; none where there is nothing yet that could hold any."""

    def note_uses(self, used_us: Mapping[str, int]) -> None:
        """When tokens were used last, by name."""


def new_secret() -> str:
    """A token that nobody has yet."""
    return PREFIX + secrets.token_urlsafe(_RANDOM_BYTES)


def is_shaped(secret: str) -> bool:
    """Whether this could be a token at all."""
    return _SHAPE.fullmatch(secret) is not None


def digest_of(secret: str) -> str:
    """What is stored of a token: 64 hexadecimal digits."""
    return blake2b(secret.encode(), digest_size=32, key=_KEY).hexdigest()


def find(secret: str, tokens: Sequence[Token]) -> Token | None:
    """The token that this is; takes as long whichever it is, and whether it is one."""
    digest = digest_of(secret).encode()
    found: Token | None = None
    for token in tokens:
        if hmac.compare_digest(digest, token.digest.encode()):
            found = token
    return found
