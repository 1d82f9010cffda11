from contextlib import closing
from pathlib import Path

import pytest
from covista_schemas.errors import MissingExtraError
from covista_service.access import AccessError, Scope, TokenError
from covista_service.app import create_app
from covista_service.config import load
from covista_service.store.database import DatabaseError
from covista_service.store.tokens import Tokens
from covista_service.workers import scheduler


@pytest.mark.parametrize(
    ("name", "value", "refused"),
    [("api", "0.0.0.0:0", AccessError), ("database", "nonsense://somewhere/db", DatabaseError)],
)
def test_what_can_never_work_is_refused_before_anything_is_opened(
    name: str, value: str, refused: type[Exception]
) -> None:
    with pytest.raises(refused, match=name):
        create_app(load({name: value}))


def test_the_network_is_listened_to_only_with_a_token_that_is_good(tmp_path: Path) -> None:
    file = tmp_path / "covista.db"
    settings = load({"api": "0.0.0.0:0", "link": "tcp/127.0.0.1:0", "database": f"sqlite:///{file}"})
    with closing(Tokens(settings.database)) as tokens:
        tokens.add("old", frozenset({Scope.READ}))
        tokens.revoke("old")
        with pytest.raises(AccessError, match="there is no token yet"):
            create_app(settings)
        tokens.add("new", frozenset({Scope.READ}))
        create_app(settings)


def test_the_network_is_not_listened_to_while_tokens_cannot_be_read(tmp_path: Path) -> None:
    file = tmp_path / "covista.db"
    file.write_bytes(b"no database" * 1000)
    flags = {"link": "tcp/127.0.0.1:0", "database": f"sqlite:///{file}"}
    with pytest.raises(TokenError, match=r"cannot be used: .* api = 0\.0\.0\.0:0 is not opened"):
        create_app(load({"api": "0.0.0.0:0"} | flags))
    create_app(load({"api": "127.0.0.1:0"} | flags))


def test_a_cluster_without_its_extra_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError) as caught:
        create_app(load({"workers": "dask://127.0.0.1:8786"}))
    said = str(caught.value)
    assert said == "workers = dask://127.0.0.1:8786 needs an optional extra: pip install 'covista[scale]'"
