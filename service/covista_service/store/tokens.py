"""Tokens in the database: made and revoked by the command line, read by the station that is running."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from sqlalchemy import Connection, Engine, Row, insert, inspect, select, update
from sqlalchemy.exc import IntegrityError

from covista_service.access import scopes
from covista_service.access.scopes import Scopes
from covista_service.access.tokens import Token, TokenError, digest_of, new_secret
from covista_service.store.database import UNUSABLE, file_is_gone, first_line, open_engine
from covista_service.store.migrations import upgrade
from covista_service.store.tables import tokens


class Tokens:
    """The tokens in the database at `url`, which is opened when it is needed. Calls raise TokenError.

    The station reads every second, over a connection that stays; all else opens one for itself.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self._reader = open_engine(url, reads=True)

    def read(self) -> Sequence[Token]:
        """All tokens, revoked ones too, in the order in which they were made."""
        if file_is_gone(self._reader):
            return []
        with _using(self._reader) as connection:
            if not inspect(connection).has_table(tokens.name):
                return []
            return [_token(row) for row in connection.execute(select(tokens).order_by(tokens.c.id))]

    def add(self, name: str, held: Scopes) -> str:
        """Make a token and return it: it is stored nowhere, only its digest."""
        secret = new_secret()
        row = {"name": name, "digest": digest_of(secret), "scopes": scopes.written(held), "created_us": _now_us()}
        with self._writing() as connection:
            upgrade(connection)
            try:
                connection.execute(insert(tokens), row)
            except IntegrityError as error:
                raise TokenError(f"there is a token {name} already; revoked ones keep their names") from error
        return secret

    def revoke(self, name: str) -> None:
        """End a token; it stays on the list."""
        for token in self.read():
            if token.name == name:
                break
        else:
            raise TokenError(f"there is no token {name}")
        if token.revoked_us is not None:
            raise TokenError(f"token {name} is revoked already")
        with self._writing() as connection:
            connection.execute(update(tokens).where(tokens.c.name == name).values(revoked_us=_now_us()))

    def note_uses(self, used_us: Mapping[str, int]) -> None:
        """When tokens were used last, by name."""
        if file_is_gone(self._reader):
            return
        with self._writing() as connection:
            for name, at_us in used_us.items():
                connection.execute(update(tokens).where(tokens.c.name == name).values(last_used_us=at_us))

    def close(self) -> None:
        """Let go of the connection."""
        self._reader.dispose()

    @contextmanager
    def _writing(self) -> Iterator[Connection]:
        engine = open_engine(self.url)
        try:
            with _using(engine) as connection:
                yield connection
        finally:
            engine.dispose()


@contextmanager
def _using(engine: Engine) -> Iterator[Connection]:
    """A transaction. Raises TokenError where the database cannot be used."""
    try:
        with engine.begin() as connection:
            yield connection
    except UNUSABLE as error:
        raise TokenError(f"the database of the tokens cannot be used: {first_line(error)}") from error


def _token(row: Row[tuple[object, ...]]) -> Token:
    return Token(
        name=row.name,
        digest=row.digest,
        scopes=scopes.read(row.scopes),
        created_us=row.created_us,
        revoked_us=row.revoked_us,
        last_used_us=row.last_used_us,
    )


def _now_us() -> int:
    return time.time_ns() // 1000
