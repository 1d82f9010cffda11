import hmac
import inspect
import secrets

import pytest
from covista_service.access import Scope, Token, scopes, tokens
from covista_service.access.scopes import covers
from covista_service.access.tokens import digest_of, find, is_shaped, new_secret


def token(name: str, secret: str) -> Token:
    return Token(name, digest_of(secret), frozenset({Scope.READ}), created_us=1)


def test_a_token_has_256_random_bits_and_is_recognised(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    real = secrets.token_urlsafe
    monkeypatch.setattr(secrets, "token_urlsafe", lambda count: (asked.append(count), real(count))[1])
    made = {new_secret() for _ in range(100)}
    assert asked == [32] * 100
    assert len(made) == 100
    assert all(is_shaped(each) and each.startswith("covista_") for each in made)


@pytest.mark.parametrize("text", ["", "covista_", "covista_" + 42 * "a", "covista_" + 44 * "a", "covista_" + 43 * "ä"])
def test_what_cannot_be_a_token_is_told_apart(text: str) -> None:
    assert not is_shaped(text)
    assert not is_shaped(f"{new_secret()}\n")


def test_a_digest_is_one_way_fixed_and_no_plain_hash() -> None:
    # Stored digests must be good after an update.
    assert digest_of("covista_x") == "57072dbc7d11e589e0b6e5f4dc99ac48709d969fd4b84e2bfd4c8b1d95ffd739"
    assert digest_of("covista_y") != digest_of("covista_x")


def test_a_token_is_found_among_others_and_a_stranger_is_not() -> None:
    held = [new_secret() for _ in range(5)]
    known = [token(f"t{index}", secret) for index, secret in enumerate(held)]
    for index, secret in enumerate(held):
        found = find(secret, known)
        assert found is not None
        assert found.name == f"t{index}"
    assert find(new_secret(), known) is None
    assert find(held[0], []) is None


def test_every_token_is_compared_in_constant_time_wherever_the_right_one_stands(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compared: list[bytes] = []
    real = hmac.compare_digest

    def counting(one: bytes, other: bytes) -> bool:
        compared.append(other)
        return real(one, other)

    monkeypatch.setattr(hmac, "compare_digest", counting)
    held = [new_secret() for _ in range(4)]
    known = [token(f"t{index}", secret) for index, secret in enumerate(held)]
    for secret in (held[0], held[3], new_secret()):
        compared.clear()
        find(secret, known)
        assert compared == [each.digest.encode() for each in known]
    assert "==" not in inspect.getsource(tokens.find)


def test_a_token_shown_says_nothing_of_its_digest() -> None:
    secret = new_secret()
    assert digest_of(secret) not in repr(token("t", secret))


def test_operate_includes_read_and_read_nothing_more() -> None:
    read, operate = frozenset({Scope.READ}), frozenset({Scope.OPERATE})
    assert covers(read, Scope.READ)
    assert not covers(read, Scope.OPERATE)
    assert covers(operate, Scope.READ)
    assert covers(operate, Scope.OPERATE)
    assert not covers(frozenset(), Scope.READ)


@pytest.mark.parametrize("held", [{Scope.READ}, {Scope.OPERATE}, {Scope.OPERATE, Scope.READ}, set()])
def test_scopes_are_read_as_they_were_written(held: set[Scope]) -> None:
    assert scopes.read(scopes.written(held)) == held


def test_a_scope_of_another_version_allows_nothing() -> None:
    assert scopes.read("read everything") == {Scope.READ}
    assert scopes.read("everything") == frozenset()
