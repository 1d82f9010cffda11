"""Tokens in databases of each kind."""

import asyncio
import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from covista_service.access import Admitted, Gate, Keyring, Refusal, Refused, Scope, TokenError, TokenWatch
from covista_service.access.tokens import digest_of, find, is_shaped, new_secret
from covista_service.store.database import open_engine
from covista_service.store.tokens import Tokens
from sqlalchemy import text

from tests.service.deadline import wait_until
from tests.service.store.server import Server

READ, OPERATE = frozenset({Scope.READ}), frozenset({Scope.OPERATE})


@pytest.fixture
def tokens(url: str) -> Iterator[Tokens]:
    with closing(Tokens(url)) as opened:
        yield opened


def test_where_nothing_is_there_are_no_tokens_and_nothing_is_made(tokens: Tokens, tmp_path: Path) -> None:
    assert tokens.read() == []
    tokens.note_uses({})
    assert not (tmp_path / "covista.db").exists()


def test_a_token_is_read_as_it_was_made_and_only_its_digest_is_stored(tokens: Tokens, url: str) -> None:
    begun_us = time.time_ns() // 1000
    secret = tokens.add("a", READ | OPERATE)
    assert is_shaped(secret)
    (token,) = tokens.read()
    assert (token.name, token.scopes, token.digest) == ("a", READ | OPERATE, digest_of(secret))
    assert begun_us <= token.created_us <= time.time_ns() // 1000
    assert token.revoked_us is None
    assert token.last_used_us is None
    engine = open_engine(url)
    with engine.connect() as connection:
        stored = str(connection.execute(text("select * from tokens")).all())
    engine.dispose()
    assert secret.removeprefix("covista_") not in stored


def test_another_reader_sees_what_is_made_and_revoked(tokens: Tokens, url: str) -> None:
    assert tokens.read() == []
    with closing(Tokens(url)) as command:
        secrets = [command.add(name, READ) for name in ("a", "b")]
        assert [token.name for token in tokens.read()] == ["a", "b"]
        command.revoke("a")
    gone, kept = tokens.read()
    assert find(secrets[0], tokens.read()) == gone
    assert gone.revoked_us is not None
    assert kept.revoked_us is None


def test_a_name_is_taken_for_good(tokens: Tokens) -> None:
    tokens.add("a", READ)
    for _ in range(2):
        with pytest.raises(TokenError, match="there is a token a already"):
            tokens.add("a", READ)
        if tokens.read()[0].revoked_us is None:
            tokens.revoke("a")
    assert len(tokens.read()) == 1


def test_what_is_not_there_or_revoked_cannot_be_revoked(tokens: Tokens) -> None:
    with pytest.raises(TokenError, match="there is no token a"):
        tokens.revoke("a")
    tokens.add("a", READ)
    tokens.revoke("a")
    with pytest.raises(TokenError, match="revoked already"):
        tokens.revoke("a")


def test_uses_are_noted_and_those_of_strangers_do_no_harm(tokens: Tokens) -> None:
    tokens.add("a", READ)
    tokens.note_uses({"a": 17, "stranger": 18})
    (token,) = tokens.read()
    assert token.last_used_us == 17


def test_a_file_that_is_deleted_has_no_tokens_and_the_one_in_its_place_its_own(tmp_path: Path) -> None:
    file = tmp_path / "covista.db"
    with closing(Tokens(f"sqlite:///{file}")) as tokens:
        tokens.add("a", READ)
        assert len(tokens.read()) == 1
        for each in tmp_path.iterdir():
            each.unlink()
        assert tokens.read() == []
        tokens.note_uses({"a": 1})
        assert not file.exists()
        tokens.add("b", READ)
        assert [token.name for token in tokens.read()] == ["b"]


def test_a_file_that_is_no_database_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "covista.db").write_bytes(b"no database" * 1000)
    with closing(Tokens(f"sqlite:///{tmp_path / 'covista.db'}")) as tokens:
        for call in (tokens.read, lambda: tokens.add("a", READ), lambda: tokens.note_uses({"a": 1})):
            with pytest.raises(TokenError, match=r"^the database of the tokens cannot be used: [^\n]+$"):
                call()


def test_reading_waits_for_no_writer(tmp_path: Path) -> None:
    file = tmp_path / "covista.db"
    with closing(Tokens(f"sqlite:///{file}")) as tokens:
        tokens.add("a", READ)
        with closing(sqlite3.connect(file, isolation_level=None)) as other:
            other.execute("BEGIN EXCLUSIVE")
            assert len(tokens.read()) == 1
            with pytest.raises(TokenError, match="locked"):
                tokens.add("b", READ)
            other.execute("ROLLBACK")
        tokens.add("b", READ)


def test_a_server_that_is_not_there_is_one_line() -> None:
    url = "postgresql+psycopg://nobody:hush@127.0.0.1:1/none"
    with closing(Tokens(url)) as tokens, pytest.raises(TokenError) as caught:
        tokens.read()
    assert "\n" not in str(caught.value)
    assert "hush" not in str(caught.value)


def test_a_server_that_hangs_and_is_gone_holds_nobody_up_and_is_found_again(server: Server) -> None:
    keyring = Keyring()
    with closing(Tokens(server.new_database())) as tokens:
        secret, doomed = tokens.add("a", READ), tokens.add("b", READ)
        with closing(TokenWatch(tokens, keyring, every_s=0.05)) as watch:
            gate = Gate(keyring, news=watch.news)

            def come(secret: str) -> Admitted | Refused:
                return asyncio.run(gate.admit([f"Bearer {secret}"], Scope.READ, "10.0.0.1"))

            with server.frozen():
                begun_s = time.monotonic()
                assert come(secret) == Admitted("a")
                assert come(new_secret()) == Refused(Refusal.UNKNOWN)
                assert time.monotonic() - begun_s < 2
                wait_until(lambda: watch.health().status == "degraded", "it says so", 20)
                assert come(secret) == Admitted("a")
            wait_until(lambda: watch.health().status == "ready", "it is well again", 20)
            server.stop()
            wait_until(lambda: watch.health().status == "degraded", "it says so", 20)
            assert come(secret) == Admitted("a")
            server.start()
            with closing(Tokens(tokens.url)) as command:
                wait_until(lambda: watch.health().status == "ready", "it is well again", 20)
                command.revoke("b")
            wait_until(lambda: come(doomed) == Refused(Refusal.REVOKED), "it is out")
