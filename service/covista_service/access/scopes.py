"""What a token allows."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum


class Scope(StrEnum):
    """`read` is asking, `operate` is changing too."""

    READ = "read"
    OPERATE = "operate"


Scopes = frozenset[Scope]
_INCLUDES = {Scope.READ: frozenset({Scope.READ}), Scope.OPERATE: frozenset(Scope)}


def covers(held: Scopes, wanted: Scope) -> bool:
    """Whether who holds these scopes may do what wants that one."""
    return any(wanted in _INCLUDES[scope] for scope in held)


def written(scopes: Iterable[Scope]) -> str:
    """Scopes as they are stored and shown: in one order, each once."""
    return " ".join(scope for scope in Scope if scope in set(scopes))


def read(text: str) -> Scopes:
    """Scopes as stored. What this version does not know allows nothing."""
    known = {str(scope): scope for scope in Scope}
    return frozenset(known[word] for word in text.split() if word in known)
