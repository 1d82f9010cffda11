"""Sessions: how long they last, with what they end, and how many there are."""

import asyncio

import pytest
from covista_service.access import Admitted, Gate, Keyring, Refusal, Refused, Scope
from covista_service.access.sessions import IDLE_S, LONGEST_S, Sessions
from covista_service.access.tokens import Token

from tests.service.access.sources import Shelf

HERE = "10.0.0.1"
DAY_S = 24 * 3600.0


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def token(name: str = "reader", *scopes: Scope) -> Token:
    return Token(name, f"digest of {name}", frozenset(scopes or (Scope.READ,)), created_us=1)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def sessions(clock: Clock) -> Sessions:
    return Sessions(most=3, clock=clock)


def test_a_session_is_known_by_its_secret_alone(sessions: Sessions) -> None:
    secret = sessions.begin(token("r", Scope.OPERATE))
    found = sessions.find(secret)
    assert found is not None
    assert (found.name, found.digest, found.scopes) == ("r", "digest of r", frozenset({Scope.OPERATE}))
    assert len(secret) >= 43
    for other in ("", secret[:-1], secret + "a", secret.upper(), "\udcff"[:0] + "é", found.digest):
        assert sessions.find(other) is None
    assert secret not in repr(vars(sessions))


def test_a_session_that_is_used_goes_on_and_one_that_is_not_ends(sessions: Sessions, clock: Clock) -> None:
    used, idle = sessions.begin(token()), sessions.begin(token())
    clock.now_s = IDLE_S - 1
    assert sessions.find(used)
    clock.now_s = IDLE_S + 1
    assert sessions.find(used)
    assert sessions.find(idle) is None
    assert len(sessions) == 1


def test_to_look_at_a_session_is_no_use_of_it(sessions: Sessions, clock: Clock) -> None:
    secret = sessions.begin(token())
    clock.now_s = IDLE_S
    assert sessions.peek(secret)
    clock.now_s = IDLE_S + 1
    assert sessions.peek(secret) is None
    assert sessions.find(secret) is None


def test_no_session_lasts_for_ever_however_much_it_is_used(sessions: Sessions, clock: Clock) -> None:
    secret = sessions.begin(token())
    while clock.now_s <= LONGEST_S:
        assert sessions.find(secret)
        clock.now_s += DAY_S / 2
    assert sessions.find(secret) is None


def test_of_too_many_the_one_not_used_for_longest_goes(sessions: Sessions) -> None:
    first, second, third = (sessions.begin(token()) for _ in range(3))
    assert sessions.find(first)
    fourth = sessions.begin(token())
    assert len(sessions) == 3
    assert [bool(sessions.peek(each)) for each in (first, second, third, fourth)] == [True, False, True, True]


def test_who_logs_out_is_out(sessions: Sessions) -> None:
    secret, other = sessions.begin(token()), sessions.begin(token())
    sessions.end(secret)
    sessions.end("never there")
    assert sessions.find(secret) is None
    assert sessions.find(other)


class Door:
    """A gate, and who has logged in there."""

    def __init__(self) -> None:
        self.shelf = Shelf()
        self.keyring = Keyring()
        self.gate = Gate(self.keyring)
        secret = self.shelf.add("reader", Scope.READ)
        self.read()
        session = asyncio.run(self.gate.log_in(secret, HERE))
        assert isinstance(session, str)
        self.session = session

    def read(self) -> None:
        self.keyring.take(self.shelf.read())

    def come(self, session: str | None = None, wanted: Scope = Scope.READ) -> Admitted | Refused:
        return self.gate.admit_session(self.session if session is None else session, wanted, HERE)


def test_a_session_allows_what_its_token_does() -> None:
    door = Door()
    assert door.come() == Admitted("reader")
    assert door.come(wanted=Scope.OPERATE) == Refused(Refusal.SCOPE)


def test_a_session_ends_with_its_token_for_good() -> None:
    door = Door()
    assert door.gate.holds(door.session)
    door.shelf.revoke("reader")
    door.read()
    assert not door.gate.holds(door.session)
    assert door.come() == Refused(Refusal.SESSION)
    assert len(door.gate.sessions) == 0


def test_another_token_of_the_same_name_is_not_the_one_that_logged_in() -> None:
    door = Door()
    door.shelf.revoke("reader")
    door.shelf.add("reader", Scope.OPERATE)
    door.read()
    assert door.come() == Refused(Refusal.SESSION)


def test_the_last_use_of_a_token_is_that_of_its_sessions_too() -> None:
    door = Door()
    begun_us = door.keyring.uses(least_us=0)["reader"]
    door.come()
    assert door.keyring.uses(least_us=0)["reader"] > begun_us


def test_what_is_no_session_is_no_failure_either() -> None:
    door = Door()
    for _ in range(100):
        assert door.come("") == Refused(Refusal.MISSING)
        assert door.come("x") == Refused(Refusal.SESSION)
    assert asyncio.run(door.gate.admit(["Bearer x"], Scope.READ, HERE)) == Refused(Refusal.UNKNOWN)


def test_sessions_wait_as_tokens_do_until_those_are_read() -> None:
    gate = Gate(Keyring())
    assert gate.admit_session("x", Scope.READ, HERE) == Refused(Refusal.UNREAD)
    assert not gate.holds("x")


def test_where_no_token_is_needed_nobody_has_a_session() -> None:
    door = Door()
    door.gate.keyring = Keyring()
    door.gate.keyring.take([])
    assert asyncio.run(door.gate.log_in("anything", HERE)) == ""
    assert door.come("") == Admitted(None)
    assert door.gate.holds("")
