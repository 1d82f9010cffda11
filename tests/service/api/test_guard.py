"""Every route against every kind of token."""

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from covista_schemas.reports import Problem
from covista_service.access import Attempts, Gate, Keyring, Scope
from covista_service.access.tokens import new_secret
from covista_service.api import guard
from covista_service.api.stream import EVENT_STREAM
from fastapi import Request
from fastapi.responses import StreamingResponse

from tests.service.access.sources import Shelf
from tests.service.api.conftest import Desk, open_gate
from tests.service.api.expositions import families

OPEN = ("/healthz", "/readyz", "/docs", "/openapi.json")
ASKED = ("/api/v1/robots", "/api/v1/robots/r1", "/api/v1/groups", "/api/v1/similarity", "/metrics", "/nothing")
# Whether there are such routes or not: who may not pass does not learn.
CHANGES = (
    ("DELETE", "/api/v1/robots/nobody"),
    ("PATCH", "/api/v1/settings/of/nothing"),
    ("PUT", "/api/v1/groups"),
    ("POST", "/api/v1/groups/nothing"),
    ("DELETE", "/metrics"),
)


class Guarded:
    """A desk behind a gate with tokens of each kind."""

    def __init__(self, most: int = 10_000) -> None:
        self.shelf = shelf = Shelf()
        self.reader = shelf.add("reader", Scope.READ)
        self.operator = shelf.add("operator", Scope.OPERATE)
        self.revoked = shelf.add("revoked", Scope.OPERATE)
        shelf.revoke("revoked")
        keyring = Keyring()
        keyring.take(shelf.read())
        self.desk = Desk(gate=Gate(keyring, Attempts(most)))

    @property
    def strangers(self) -> list[str | None]:
        """What lets nobody in."""
        return [None, "", "x", new_secret(), self.revoked]

    def ask(self, path: str, token: str | None = None, method: str = "GET") -> Any:
        return self.desk.ask(path, method, **({} if token is None else {"authorization": f"Bearer {token}"}))


@pytest.fixture(scope="module")
def guarded() -> Guarded:
    return Guarded()


def problem(response: Any, status: int) -> Problem:
    assert response.status_code == status
    assert response.headers["content-type"] == "application/problem+json"
    said = Problem.model_validate_json(response.content)
    assert said.status == status
    return said


@pytest.mark.parametrize("path", OPEN)
def test_what_is_open_is_so_with_and_without_any_token(guarded: Guarded, path: str) -> None:
    for token in (None, new_secret(), guarded.revoked, guarded.reader):
        assert guarded.ask(path, token).status_code == 200


@pytest.mark.parametrize("method", ["GET", "HEAD"])
@pytest.mark.parametrize("path", ASKED)
def test_to_ask_takes_a_token_that_may_read(guarded: Guarded, path: str, method: str) -> None:
    for token in guarded.strangers:
        response = guarded.ask(path, token, method)
        assert response.status_code == 401
        assert response.headers["www-authenticate"].startswith('Bearer realm="covista"')
    for token in (guarded.reader, guarded.operator):
        assert guarded.ask(path, token, method).status_code in (200, 404)


def test_every_operation_of_the_description_is_guarded_as_it_says() -> None:
    guarded = Guarded()
    for path, methods in guarded.ask("/openapi.json").json()["paths"].items():
        asked = re.sub(r"\{\w+\}", "nobody", path)
        for method, operation in methods.items():
            wanted = [scope for need in operation["security"] for scopes in need.values() for scope in scopes]
            if not wanted:
                assert path in OPEN
                continue
            outside = [guarded.ask(asked, token, method.upper()).status_code for token in guarded.strangers]
            assert outside == [401] * len(outside), (method, path)
            if wanted == ["operate"]:
                assert guarded.ask(asked, guarded.reader, method.upper()).status_code == 403, (method, path)
            # What streams would not end here.
            elif "text/event-stream" not in operation["responses"].get("200", {}).get("content", {}):
                assert guarded.ask(asked, guarded.reader, method.upper()).status_code not in (401, 403), (method, path)


@pytest.mark.parametrize(("method", "path"), CHANGES)
def test_to_change_takes_a_token_that_may_operate(guarded: Guarded, method: str, path: str) -> None:
    for token in (None, new_secret(), guarded.revoked):
        problem(guarded.ask(path, token, method), 401)
    refused = guarded.ask(path, guarded.reader, method)
    assert "scope operate" in str(problem(refused, 403).detail)
    assert 'error="insufficient_scope", scope="operate"' in refused.headers["www-authenticate"]
    assert guarded.ask(path, guarded.operator, method).status_code in (404, 405)


def test_a_preview_changes_nothing_so_who_reads_may_have_one(guarded: Guarded) -> None:
    assert guard.wanted_scope("POST", "/api/v1/groups/preview") is Scope.READ
    assert guarded.ask("/api/v1/groups/preview", guarded.reader, "POST").status_code not in (401, 403)
    assert guarded.ask("/api/v1/groups/preview", None, "POST").status_code == 401


@pytest.mark.parametrize("path", ["/healthz/", "//healthz", "/healthz/..", "/HEALTHZ", "/api/v1/../../healthz"])
def test_what_only_looks_open_is_closed(guarded: Guarded, path: str) -> None:
    # httpx tidies paths, so this goes in as it is.
    assert guard.wanted_scope("GET", path) is Scope.READ


def test_problems_say_what_is_wrong_and_nothing_of_what_was_shown(guarded: Guarded) -> None:
    stranger = new_secret()
    said = guarded.ask("/api/v1/groups", stranger)
    assert problem(said, 401).detail == "this token is not known"
    assert 'error="invalid_token"' in said.headers["www-authenticate"]
    assert stranger not in said.text + str(said.headers)
    assert problem(guarded.ask("/api/v1/groups", guarded.revoked), 401).detail == "this token is revoked"
    missing = guarded.ask("/api/v1/groups")
    assert "error" not in missing.headers["www-authenticate"]


def test_a_token_in_the_query_is_none(guarded: Guarded) -> None:
    for name in ("token", "access_token", "authorization"):
        problem(guarded.ask(f"/api/v1/groups?{name}={guarded.operator}"), 401)


def test_after_too_many_failures_a_good_token_still_passes() -> None:
    guarded = Guarded(most=10)
    assert [guarded.ask("/api/v1/groups").status_code for _ in range(12)] == [401] * 10 + [429] * 2
    late = guarded.ask("/api/v1/groups", new_secret())
    problem(late, 429)
    assert 1 <= int(late.headers["retry-after"]) <= 6
    assert guarded.ask("/api/v1/groups", guarded.reader).status_code == 200
    assert guarded.ask("/healthz").status_code == 200


def test_while_tokens_cannot_be_read_nobody_is_let_in_and_health_still_answers() -> None:
    desk = Desk(gate=Gate(Keyring()))
    response = desk.get("/groups")
    problem(response, 503)
    assert int(response.headers["retry-after"]) > 0
    assert desk.ask("/healthz").status_code == 200


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("localhost", 200),
        ("localhost:8000", 200),
        ("127.0.0.1:8000", 200),
        ("[::1]:8000", 200),
        ("[::1]", 200),
        ("10.0.0.7:8000", 200),
        ("station", 403),
        ("control.example:8000", 403),
        ("127.0.0.1.example", 403),
        ("localhost.example:8000", 403),
    ],
)
def test_without_tokens_a_page_cannot_give_its_own_name_to_this_machine(host: str, status: int) -> None:
    desk = Desk(gate=open_gate(any_host=False))
    assert desk.get("/groups", host=host).status_code == status
    assert Desk().get("/groups", host=host).status_code == 200


def test_with_tokens_the_host_does_not_matter(guarded: Guarded) -> None:
    headers = {"authorization": f"Bearer {guarded.reader}", "host": "control.example"}
    assert guarded.desk.get("/groups", **headers).status_code == 200


def test_refusals_are_counted_by_reason_without_a_name_or_an_address() -> None:
    guarded = Guarded()
    stranger = new_secret()
    for token in (None, stranger, guarded.revoked):
        guarded.ask("/api/v1/groups", token)
    guarded.ask("/api/v1/robots/r1", guarded.reader, "DELETE")
    text = guarded.ask("/metrics", guarded.reader).text
    counts = {
        sample.labels["reason"]: sample.value
        for sample in families(text)["covista_access_refused_total"].samples
        if sample.name.endswith("_total")
    }
    assert {reason: count for reason, count in counts.items() if count} == {
        "missing": 1,
        "unknown": 1,
        "revoked": 1,
        "scope": 1,
    }
    assert families(text)["covista_tokens"].samples[0].value == 2
    assert not any(word in text for word in (stranger, guarded.reader, "operator", "127.0.0.1"))


def test_routes_are_told_who_asks() -> None:
    guarded = Guarded()
    asked: list[str | None] = []

    @guarded.desk.app.get("/who")
    def who(request: Request) -> None:
        asked.append(request.scope[guard.BY])

    guarded.ask("/who", guarded.operator)
    open_desk = Desk()
    open_desk.app.get("/who")(who)
    open_desk.ask("/who")
    assert asked == ["operator", None]


@pytest.mark.parametrize("open_at_first", [False, True])
def test_an_answer_under_way_ends_when_its_token_is_revoked_or_the_first_one_made(open_at_first: bool) -> None:
    guarded = Guarded()
    desk = Desk() if open_at_first else guarded.desk

    def parts() -> Iterator[str]:
        yield "before"
        if not open_at_first:
            guarded.shelf.revoke("reader")
        desk.gate.keyring.take(guarded.shelf.read())
        yield "after"
        yield "later"

    desk.app.get("/stream")(lambda: StreamingResponse(parts()))
    token = {} if open_at_first else {"authorization": f"Bearer {guarded.reader}"}
    assert desk.ask("/stream", **token).text == "before"
    assert desk.ask("/stream", **token).status_code == 401


def test_an_answer_of_which_nothing_is_out_yet_is_refused_as_a_whole() -> None:
    guarded = Guarded()

    def parts() -> Iterator[str]:
        guarded.shelf.revoke("reader")
        guarded.desk.gate.keyring.take(guarded.shelf.read())
        yield "too late"

    guarded.desk.app.get("/stream")(lambda: StreamingResponse(parts()))
    answer = guarded.ask("/stream", guarded.reader)
    assert answer.status_code == 401
    assert Problem.model_validate_json(answer.text).detail == "this token is revoked"


def test_an_answer_that_is_whole_goes_to_who_was_let_in_when_it_was_asked_for() -> None:
    guarded = Guarded()

    @guarded.desk.app.get("/whole")
    def whole() -> str:
        guarded.shelf.revoke("reader")
        guarded.desk.gate.keyring.take(guarded.shelf.read())
        return "all of it"

    assert guarded.ask("/whole", guarded.reader).json() == "all of it"
    assert guarded.ask("/whole", guarded.reader).status_code == 401


@pytest.mark.parametrize(("open_at_first", "said"), [(False, "this token is revoked"), (True, "a token is needed")])
def test_a_stream_that_may_not_go_on_has_a_last_word_that_says_why(open_at_first: bool, said: str) -> None:
    guarded = Guarded()
    desk = Desk() if open_at_first else guarded.desk

    def parts() -> Iterator[str]:
        yield ": alive\n\n"
        if not open_at_first:
            guarded.shelf.revoke("reader")
        desk.gate.keyring.take(guarded.shelf.read())
        yield "id: 1\nevent: join\ndata: {}\n\n"

    desk.app.get("/stream")(lambda: StreamingResponse(parts(), media_type=EVENT_STREAM))
    token = {} if open_at_first else {"authorization": f"Bearer {guarded.reader}"}
    alive, last, rest = desk.ask("/stream", **token).text.split("\n\n")
    assert (alive, rest) == (": alive", "")
    name, data = last.splitlines()
    assert name == "event: cut"
    assert said in (Problem.model_validate_json(data.removeprefix("data: ")).detail or "")


def test_every_operation_says_which_token_it_takes_and_what_comes_without_it(guarded: Guarded) -> None:
    description = guarded.ask("/openapi.json").json()
    (name,) = description["components"]["securitySchemes"]
    assert description["components"]["securitySchemes"][name]["scheme"] == "bearer"
    for path, methods in description["paths"].items():
        for method, operation in methods.items():
            wanted = guard.wanted_scope(method.upper(), path)
            assert operation["security"] == ([] if path in OPEN else [{name: [str(wanted)]}])
            needed = set() if path in OPEN else {"401", "403", "429", "503"}
            assert needed <= operation["responses"].keys()
            for status in needed:
                assert "application/problem+json" in operation["responses"][status]["content"]
                assert operation["responses"][status]["headers"]
    json.dumps(description)
