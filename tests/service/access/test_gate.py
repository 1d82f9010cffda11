import asyncio
import logging

import pytest
from covista_service.access import Admitted, Attempts, Gate, Keyring, Refusal, Refused, Scope
from covista_service.access.tokens import new_secret

from tests.service.access.sources import Shelf

HERE = "10.0.0.1"


class Post:
    """A gate, and whoever comes to it."""

    def __init__(self, most: int = 1000) -> None:
        self.shelf = Shelf()
        self.reader = self.shelf.add("reader", Scope.READ)
        self.operator = self.shelf.add("operator", Scope.OPERATE)
        self.keyring = Keyring()
        self.keyring.take(self.shelf.read())
        self.gate = Gate(self.keyring, Attempts(most), news=self.news)

    async def news(self) -> None:
        self.keyring.take(self.shelf.read())

    def come(self, *credentials: str, wanted: Scope = Scope.READ, address: str = HERE) -> Admitted | Refused:
        return asyncio.run(self.gate.admit(list(credentials), wanted, address))


@pytest.fixture
def post() -> Post:
    return Post()


@pytest.mark.parametrize("scheme", ["Bearer", "bearer", "BEARER", "Bearer "])
def test_a_good_token_is_let_in_by_its_name(post: Post, scheme: str) -> None:
    assert post.come(f"{scheme} {post.reader}") == Admitted("reader")


def test_each_may_do_what_its_scope_says(post: Post) -> None:
    assert post.come(f"Bearer {post.operator}", wanted=Scope.OPERATE) == Admitted("operator")
    assert post.come(f"Bearer {post.operator}") == Admitted("operator")
    assert post.come(f"Bearer {post.reader}", wanted=Scope.OPERATE) == Refused(Refusal.SCOPE)


@pytest.mark.parametrize(
    ("credentials", "reason"),
    [
        ([], Refusal.MISSING),
        ([""], Refusal.MALFORMED),
        (["Bearer"], Refusal.MALFORMED),
        (["Bearer "], Refusal.MALFORMED),
        (["Basic {good}"], Refusal.MALFORMED),
        (["{good}"], Refusal.MALFORMED),
        (["Bearer {good}", "Bearer {good}"], Refusal.MALFORMED),
        (["Bearer {good}x"], Refusal.UNKNOWN),
        (["Bearer {good}, Bearer {good}"], Refusal.UNKNOWN),
        (["Bearer covista_"], Refusal.UNKNOWN),
        (["Bearer " + 60_000 * "x"], Refusal.UNKNOWN),
        (["Bearer \xff"], Refusal.UNKNOWN),
        (["Bearer {new}"], Refusal.UNKNOWN),
    ],
)
def test_all_others_stay_out_and_are_counted_by_reason(post: Post, credentials: list[str], reason: Refusal) -> None:
    shown = [each.format(good=post.reader, new=new_secret()) for each in credentials]
    assert post.come(*shown) == Refused(reason)
    assert {name for name, count in post.gate.refused.items() if count} == {reason}


def test_a_token_made_a_moment_ago_is_let_in(post: Post) -> None:
    assert post.come(f"Bearer {post.shelf.add('new')}") == Admitted("new")


def test_a_revoked_token_is_told_so(post: Post) -> None:
    post.shelf.revoke("reader")
    post.keyring.take(post.shelf.read())
    assert post.come(f"Bearer {post.reader}") == Refused(Refusal.REVOKED)


def test_after_too_many_failures_only_failures_are_turned_away() -> None:
    post = Post(most=3)
    assert [post.come() for _ in range(3)] == [Refused(Refusal.MISSING)] * 3
    for credentials in ([], ["Bearer x"], [f"Bearer {new_secret()}"]):
        late = post.come(*credentials)
        assert isinstance(late, Refused)
        assert late.reason is Refusal.LIMITED
        assert 0 < late.retry_after_s <= 20
    assert post.come(f"Bearer {post.reader}") == Admitted("reader")
    assert post.come(address="10.0.0.2") == Refused(Refusal.MISSING)


def test_who_has_a_token_is_not_limited_for_asking_too_much_of_it() -> None:
    post = Post(most=1)
    asked = [post.come(f"Bearer {post.reader}", wanted=Scope.OPERATE) for _ in range(5)]
    assert asked == [Refused(Refusal.SCOPE)] * 5


def test_nobody_is_let_in_before_the_tokens_are_read() -> None:
    post = Post()
    gate = Gate(Keyring())
    for credentials in ([], [f"Bearer {post.operator}"]):
        assert asyncio.run(gate.admit(credentials, Scope.READ, HERE)) == Refused(Refusal.UNREAD)


def test_everybody_is_let_in_where_there_are_no_tokens() -> None:
    keyring = Keyring()
    keyring.take([])
    for credentials in ([], ["Bearer x"], [f"Bearer {new_secret()}"]):
        assert asyncio.run(Gate(keyring).admit(credentials, Scope.OPERATE, HERE)) == Admitted(None)


def test_no_log_line_has_what_was_shown(post: Post, caplog: pytest.LogCaptureFixture) -> None:
    stranger = new_secret()
    with caplog.at_level(logging.DEBUG):
        post.come(f"Bearer {stranger}")
        post.come(f"Basic {stranger}")
        post.come(f"Bearer {post.reader}", wanted=Scope.OPERATE)
    lines = [f"{record.getMessage()} {record.__dict__}" for record in caplog.records]
    assert sum(HERE in line for line in lines) == 3
    assert not any(stranger in line or post.reader in line for line in lines)
