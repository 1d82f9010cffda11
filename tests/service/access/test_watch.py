"""The keyring follows the database, and goes on without it."""

import asyncio
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from covista_service.access import Door, Keyring, TokenWatch, watch
from covista_service.access.keyring import USE_US
from covista_service.access.tokens import new_secret

from tests.service.access.sources import Shelf
from tests.service.deadline import wait_until


@contextmanager
def watching(shelf: Shelf, keyring: Keyring, every_s: float = 0.01) -> Iterator[TokenWatch]:
    before = threading.active_count()
    each = TokenWatch(shelf, keyring, every_s=every_s)
    try:
        yield each
    finally:
        shelf.answers.set()
        each.close()
    assert threading.active_count() == before


def test_tokens_are_there_as_soon_as_it_is() -> None:
    shelf, keyring = Shelf(), Keyring()
    secret = shelf.add("a")
    with watching(shelf, keyring, every_s=60):
        found = keyring.find(secret)
        assert found is not None
        assert found.name == "a"
        assert keyring.door is Door.LOCKED


def test_without_tokens_the_door_is_open_unless_it_is_to_be_locked() -> None:
    for locked, door in ((False, Door.OPEN), (True, Door.LOCKED)):
        keyring = Keyring(locked=locked)
        assert keyring.door is Door.UNKNOWN
        with watching(Shelf(), keyring):
            assert keyring.door is door


def test_a_door_that_was_locked_is_never_open_again() -> None:
    shelf, keyring = Shelf(), Keyring()
    secret = shelf.add("a")
    with watching(shelf, keyring):
        shelf.revoke("a")
        wait_until(lambda: (found := keyring.find(secret)) is not None and found.revoked_us, "it is revoked")
        assert keyring.door is Door.LOCKED
        assert keyring.live == 0


def test_nobody_knows_whether_tokens_are_needed_while_they_cannot_be_read() -> None:
    shelf, keyring = Shelf(problem="away"), Keyring()
    secret = shelf.add("a")
    with watching(shelf, keyring) as each:
        assert keyring.door is Door.UNKNOWN
        assert each.health().status == "degraded"
        assert "away" in str(each.health().detail)
        shelf.problem = None
        wait_until(lambda: keyring.find(secret), "it is read")
        wait_until(lambda: each.health().status == "ready", "it is well")


def test_the_last_tokens_go_on_while_the_database_is_away_or_replaced_by_an_empty_one() -> None:
    shelf, keyring = Shelf(), Keyring()
    secret, other = shelf.add("a"), shelf.add("b")
    shelf.revoke("b")
    with watching(shelf, keyring) as each:
        shelf.problem = "gone"
        wait_until(lambda: each.health().status == "degraded", "it is seen to be gone")
        assert keyring.find(secret)
        shelf.problem, shelf.tokens, reads = None, [], shelf.reads
        wait_until(lambda: shelf.reads > reads + 1, "it is read again")
        assert keyring.find(secret)
        assert keyring.door is Door.LOCKED
        found = keyring.find(other)
        assert found is not None
        assert found.revoked_us is not None


def test_what_was_revoked_stays_so_when_an_old_copy_comes_back() -> None:
    shelf, keyring = Shelf(), Keyring()
    secret = shelf.add("a")
    copy = shelf.tokens
    shelf.revoke("a")
    with watching(shelf, keyring):
        shelf.tokens, reads = copy, shelf.reads
        wait_until(lambda: shelf.reads > reads + 1, "it is read again")
        found = keyring.find(secret)
        assert found is not None
        assert found.revoked_us is not None


def test_a_bug_in_reading_does_not_end_it() -> None:
    shelf, keyring = Shelf(), Keyring()
    with watching(shelf, keyring) as each:
        tokens, shelf.tokens = shelf.tokens, None  # type: ignore[assignment]
        wait_until(lambda: each.health().status == "degraded", "it has failed")
        shelf.tokens = tokens
        secret = shelf.add("a")
        wait_until(lambda: keyring.find(secret), "it goes on")


def test_news_come_at_once_when_asked_for_and_not_for_each_stranger() -> None:
    shelf, keyring = Shelf(), Keyring()
    with watching(shelf, keyring, every_s=60) as each:
        secret = shelf.add("a")

        async def ask() -> None:
            await asyncio.gather(*(each.news() for _ in range(100)))

        begun_s = time.monotonic()
        asyncio.run(ask())
        assert keyring.find(secret)
        assert shelf.reads <= 2 + (time.monotonic() - begun_s) / watch.AGAIN_S


def test_a_database_that_does_not_answer_holds_nobody_for_long() -> None:
    shelf, keyring = Shelf(), Keyring()
    secret = shelf.add("a")
    with watching(shelf, keyring) as each:
        shelf.answers.clear()
        begun_s = time.monotonic()
        asyncio.run(each.news())
        assert time.monotonic() - begun_s < 5 * watch.PATIENCE_S
        assert keyring.find(secret)
        assert keyring.find(new_secret()) is None


def test_the_last_use_is_stored_once_a_minute_and_at_the_end() -> None:
    shelf, keyring = Shelf(), Keyring()
    secret = shelf.add("a")
    with watching(shelf, keyring):
        token = keyring.find(secret)
        assert token is not None
        keyring.used(token.name)
        wait_until(lambda: "a" in shelf.uses, "it is noted")
        wait_until(lambda: not keyring.uses(), "it is known to be noted")
        first_us = shelf.uses["a"]
        assert abs(first_us - time.time_ns() // 1000) < USE_US
        keyring.used(token.name)
        reads = shelf.reads
        wait_until(lambda: shelf.reads > reads + 1, "it has been looked at again")
        assert shelf.uses["a"] == first_us
    assert shelf.uses["a"] > first_us
