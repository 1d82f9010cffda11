"""`covista-station token` as a process."""

import json
from contextlib import closing
from pathlib import Path

import pytest
from covista_service.access import Scope
from covista_service.access.tokens import is_shaped
from covista_service.store.tokens import Tokens

from tests.system.station_commands import command, token


def test_a_token_is_alone_on_stdout_once_and_listed_without_itself(tmp_path: Path) -> None:
    done = command(tmp_path, "token", "add", "control", "--scope", "operate")
    assert done.returncode == 0
    secret = done.stdout.removesuffix("\n")
    assert is_shaped(secret)
    assert "control (operate)" in done.stderr
    assert secret not in done.stderr
    listed = token(tmp_path, "list")
    assert listed.splitlines()[0].split() == ["name", "scopes", "created", "last_used", "revoked"]
    assert listed.splitlines()[1].startswith("control  operate  20")
    assert secret.removeprefix("covista_") not in listed
    assert secret.removeprefix("covista_").encode() not in (tmp_path / "covista.db").read_bytes()


def test_scopes_are_read_unless_more_is_said_and_revoked_ones_stay_on_the_list(tmp_path: Path) -> None:
    assert command(tmp_path, "token", "list").stderr.startswith("there are no tokens in sqlite:///")
    assert not (tmp_path / "covista.db").exists()
    token(tmp_path, "add", "a")
    token(tmp_path, "add", "b", "--scope", "read", "--scope", "operate")
    token(tmp_path, "revoke", "a")
    listed = json.loads(token(tmp_path, "list", "--format", "json"))
    assert [(row["name"], row["scopes"], row["revoked"] is None) for row in listed] == [
        ("a", "read", False),
        ("b", "read operate", True),
    ]


def test_the_database_is_the_one_that_serve_would_take(tmp_path: Path) -> None:
    (tmp_path / "station.toml").write_text('database = "sqlite:///of_file.db"\n')
    token(tmp_path, "add", "f", "--config", "station.toml")
    token(tmp_path, "add", "v", "--config", "station.toml", COVISTA_DATABASE="sqlite:///of_variable.db")
    flags = ("--config", "station.toml", "--database", "sqlite:///of_flag.db")
    token(tmp_path, "add", "x", *flags, COVISTA_DATABASE="sqlite:///of_variable.db")
    for name, file in (("f", "file"), ("v", "variable"), ("x", "flag")):
        listed = json.loads(token(tmp_path, "list", "--format", "json", "--database", f"sqlite:///of_{file}.db"))
        assert [row["name"] for row in listed] == [name]


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["add", "taken"], 1, "there is a token taken already"),
        (["add", "Large"], 1, "'Large' is no name"),
        (["add", 64 * "x"], 1, "is no name"),
        (["revoke", "stranger"], 1, "there is no token stranger"),
        (["add", "a", "--database", "sqlite:////absent/folder/covista.db"], 1, "cannot be used: unable to open"),
        (["add", "a", "--database", "postgresql+psycopg://u:hush@127.0.0.1:1/d"], 1, "cannot be used: connection"),
        (["add", "a", "--database", "nonsense"], 2, "setting database"),
        (["list", "--config", "absent.toml"], 2, "absent.toml cannot be read"),
    ],
)
def test_what_cannot_be_done_is_one_line(tmp_path: Path, words: list[str], status: int, said: str) -> None:
    with closing(Tokens(f"sqlite:///{tmp_path / 'covista.db'}")) as tokens:
        tokens.add("taken", frozenset({Scope.READ}))
    done = command(tmp_path, "token", *words)
    assert done.returncode == status
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert said in line
    assert "hush" not in line
