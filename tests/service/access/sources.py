"""Where tokens come from in these tests, without a database."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from covista_service.access import Scope, Token, TokenError
from covista_service.access.tokens import digest_of, new_secret


@dataclass
class Shelf:
    """Tokens in memory; may be out of reach, or answer only when it is let."""

    tokens: list[Token] = field(default_factory=list)
    problem: str | None = None
    reads: int = 0
    uses: dict[str, int] = field(default_factory=dict)
    answers: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self.answers.set()

    def add(self, name: str, *scopes: Scope) -> str:
        secret = new_secret()
        self.tokens.append(Token(name, digest_of(secret), frozenset(scopes or (Scope.READ,)), created_us=1))
        return secret

    def revoke(self, name: str) -> None:
        self.tokens = [replace(each, revoked_us=2) if each.name == name else each for each in self.tokens]

    def read(self) -> Sequence[Token]:
        self.answers.wait(10)
        self.reads += 1
        if self.problem is not None:
            raise TokenError(self.problem)
        return list(self.tokens)

    def note_uses(self, used_us: Mapping[str, int]) -> None:
        if self.problem is not None:
            raise TokenError(self.problem)
        self.uses |= used_us
