"""A station that is asked over real sockets: tokens while it runs, bodies, headers, origins."""

import json
import logging
import socket
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from covista_schemas.reports import Problem
from covista_service.access import Scope
from covista_service.access.tokens import new_secret
from covista_service.api.bodies import MAX_BYTES
from covista_service.config import Settings
from covista_service.dashboard.places import has_pages
from covista_service.serve import Running
from covista_service.store.tokens import Tokens
from covista_service.telemetry import log_to_stderr

from tests.service.deadline import wait_until
from tests.system.running_station import running_station, settings_for

REVOKED_S = 2.0
READ, OPERATE = frozenset({Scope.READ}), frozenset({Scope.OPERATE})
ORIGIN = "https://control.example:8443"


@dataclass
class Site:
    """A station that runs, and its tokens."""

    running: Running
    settings: Settings
    tokens: Tokens
    reader: str

    def get(self, path: str, token: str | None = None, **headers: str) -> httpx.Response:
        given = headers | ({} if token is None else {"authorization": f"Bearer {token}"})
        return httpx.get(f"{self.running.url}{path}", headers=given)

    def status(self, token: str | None = None) -> int:
        return self.get("/api/v1/groups", token).status_code

    @property
    def file(self) -> Path:
        return Path(str(self.settings.database).removeprefix("sqlite:///"))


@contextmanager
def station(folder: Path, **changes: object) -> Iterator[Site]:
    settings = settings_for(folder, **changes)
    with closing(Tokens(settings.database)) as tokens:
        reader = tokens.add("reader", READ)
        with running_station(settings) as running:
            wait_until(lambda: httpx.get(f"{running.url}/readyz").json()["status"] == "ready", "it is ready", 60)
            yield Site(running, settings, tokens, reader)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with station(tmp_path_factory.mktemp("site"), cors_origins=(ORIGIN,)) as running:
        yield running


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Site]:
    with station(tmp_path) as running:
        yield running


def test_a_token_made_while_it_runs_is_let_in_at_once_and_one_revoked_is_out_within_two_seconds(own: Site) -> None:
    secret = own.tokens.add("new", OPERATE)
    assert own.status(secret) == 200
    own.tokens.revoke("new")
    begun_s = time.monotonic()
    # Failures are counted: it is looked at only as often as an address may fail.
    wait_until(lambda: own.status(secret) == 401, "it is out", REVOKED_S)
    assert time.monotonic() - begun_s < REVOKED_S
    assert own.status(own.reader) == 200


def test_a_station_without_tokens_asks_for_one_from_the_first_on(tmp_path: Path) -> None:
    settings = settings_for(tmp_path)
    with running_station(settings) as running, closing(Tokens(settings.database)) as tokens:
        wait_until(lambda: httpx.get(f"{running.url}/readyz").json()["status"] == "ready", "it is ready", 60)
        url = f"{running.url}/api/v1/groups"
        assert httpx.get(url).status_code == 200
        secret = tokens.add("first", READ)
        wait_until(lambda: httpx.get(url).status_code == 401, "it is locked", REVOKED_S)
        assert httpx.get(url, headers={"authorization": f"Bearer {secret}"}).status_code == 200
        assert httpx.get(f"{running.url}/readyz").json()["parts"]["access"]["detail"] == "tokens are required"


def test_a_database_that_is_deleted_opens_the_station_to_nobody_and_closes_it_to_nobody(own: Site) -> None:
    for each in own.file.parent.glob("covista.db*"):
        each.unlink()
    # Made under the same name in the new file, and known once that has been read.
    wait_until(lambda: own.tokens.read() == [], "its tokens are gone")
    later = own.tokens.add("later", READ)
    wait_until(lambda: own.status(later) == 200, "the new file is read")
    assert own.status(own.reader) == 200
    assert own.status() == 401
    assert own.status(new_secret()) == 401


def test_a_database_that_cannot_be_read_holds_nobody_up_and_says_so(own: Site) -> None:
    for each in own.file.parent.glob("covista.db*"):
        each.unlink()
    own.file.write_bytes(b"no database" * 1000)

    def access() -> dict[str, str]:
        return own.get("/readyz").json()["parts"]["access"]

    wait_until(lambda: access()["status"] == "degraded", "it says so")
    begun_s = time.monotonic()
    assert own.status(own.reader) == 200
    assert own.status(new_secret()) == 401
    assert time.monotonic() - begun_s < 2
    assert "cannot be used" in access()["detail"]


def test_the_last_use_is_told_when_it_is_over(tmp_path: Path) -> None:
    begun_us = time.time_ns() // 1000
    with station(tmp_path) as own:
        assert own.status(own.reader) == 200
    (token,) = own.tokens.read()
    assert token.last_used_us is not None
    assert token.last_used_us >= begun_us


def test_every_answer_has_the_headers_errors_too(site: Site) -> None:
    answers = [
        site.get("/healthz"),
        site.get("/api/v1/groups"),
        site.get("/api/v1/groups", site.reader),
        site.get("/api/v1/robots/nobody", site.reader),
        site.get("/nothing", site.reader),
        site.get("/metrics", site.reader),
        httpx.head(f"{site.running.url}/api/v1/groups"),
    ]
    assert [each.status_code for each in answers] == [200, 401, 200, 404, 404, 200, 401]
    for each in answers:
        assert each.headers["x-content-type-options"] == "nosniff"
        assert each.headers["x-frame-options"] == "DENY"
        assert each.headers["referrer-policy"] == "no-referrer"
        assert each.headers["content-security-policy"].startswith("default-src 'none'; frame-ancestors 'none'")
        assert each.headers["cache-control"] == ("private, no-cache" if "etag" in each.headers else "no-store")
        assert "strict-transport-security" not in each.headers
        assert "server" not in each.headers


def test_what_has_a_version_may_be_asked_for_again(site: Site) -> None:
    first = site.get("/api/v1/similarity", site.reader)
    again = site.get("/api/v1/similarity", site.reader, **{"if-none-match": first.headers["etag"]})
    assert again.status_code == 304
    assert again.headers["cache-control"] == "private, no-cache"
    assert site.get("/api/v1/similarity", None, **{"if-none-match": first.headers["etag"]}).status_code == 401


def test_the_page_of_the_docs_may_run_what_it_needs(site: Site) -> None:
    page = site.get("/docs")
    policy = dict(part.strip().split(" ", 1) for part in page.headers["content-security-policy"].split(";"))
    scripts = [part.split('"')[0] for part in page.text.split('<script src="')[1:]]
    styles = [part.split('"')[0] for part in page.text.split('rel="stylesheet" href="')[1:]]
    styles += [part.split('"')[0] for part in page.text.split('type="text/css" rel="stylesheet" href="')[1:]]
    assert scripts
    assert styles
    for directive, places in (("script-src", scripts), ("style-src", styles)):
        assert "'self'" in policy[directive].split()
        assert all(place.startswith("/") and site.get(place).status_code == 200 for place in places)
    assert policy["frame-ancestors"] == "'none'"


@pytest.mark.parametrize("path", ["/api/v1/groups", "/api/v1/robots/nobody"])
def test_pages_of_an_origin_that_is_named_may_ask_and_read_why_not(site: Site, path: str) -> None:
    for token in (None, site.reader):
        answer = site.get(path, token, origin=ORIGIN)
        assert answer.headers["access-control-allow-origin"] == ORIGIN
        assert "access-control-allow-credentials" not in answer.headers
        other = site.get(path, token, origin="https://other.example")
        assert "access-control-allow-origin" not in other.headers


def test_browsers_ask_first_without_a_token(site: Site) -> None:
    asks = {"access-control-request-method": "PATCH", "access-control-request-headers": "authorization,content-type"}
    with httpx.Client(base_url=site.running.url) as client:
        may = client.options("/api/v1/settings", headers={"origin": ORIGIN} | asks)
        assert may.status_code == 200
        assert "PATCH" in may.headers["access-control-allow-methods"]
        may_not = client.options("/api/v1/settings", headers={"origin": "https://other.example"} | asks)
        assert may_not.status_code == 400
        assert "access-control-allow-origin" not in may_not.headers


def test_without_origins_no_page_may_ask(own: Site) -> None:
    answer = own.get("/api/v1/groups", own.reader, origin=ORIGIN)
    assert not [name for name in answer.headers if name.startswith("access-control")]
    asks = {"origin": ORIGIN, "access-control-request-method": "GET"}
    assert httpx.options(f"{own.running.url}/api/v1/groups", headers=asks).status_code == 401


def post(site: Site, content: "bytes | Iterator[bytes]", token: str | None) -> httpx.Response:
    headers = {} if token is None else {"authorization": f"Bearer {token}"}
    return httpx.post(f"{site.running.url}/api/v1/groups/preview", content=content, headers=headers)


def test_a_body_may_have_64_kib_however_it_comes(site: Site) -> None:
    for count in (MAX_BYTES, MAX_BYTES + 1):
        for content in (count * b" ", iter([b" " * (count - 1), b" "])):
            answer = post(site, content, site.reader)
            assert (answer.status_code == 413) is (count > MAX_BYTES)
            if answer.status_code == 413:
                assert Problem.model_validate_json(answer.content).detail == "a request may bring 65536 bytes"


def test_who_may_not_ask_is_not_listened_to(site: Site) -> None:
    assert post(site, 10 * MAX_BYTES * b" ", None).status_code == 401


def raw(site: Site, *lines: bytes) -> socket.socket:
    """A client that says these lines."""
    host, _, port = site.running.url.removeprefix("http://").rpartition(":")
    client = socket.create_connection((host, int(port)))
    client.settimeout(10)
    if lines:
        client.sendall(b"\r\n".join([*lines, b"", b""]))
    return client


def test_forwarded_addresses_are_not_believed(own: Site) -> None:
    statuses = [
        own.get("/api/v1/groups", None, **{"x-forwarded-for": f"10.0.0.{number}"}).status_code for number in range(12)
    ]
    assert statuses.count(429) == 2


def test_heads_are_bounded(site: Site) -> None:
    with raw(site) as client:
        client.sendall(b"GET /healthz HTTP/1.1\r\nhost: x\r\nauthorization: " + 70_000 * b"x")
        assert client.recv(1000).startswith(b"HTTP/1.1 400 ")


def test_two_tokens_at_once_and_upgrades_let_nobody_in(site: Site) -> None:
    good = f"authorization: Bearer {site.reader}".encode()
    with raw(site, b"GET /api/v1/groups HTTP/1.1", b"host: x", good, good) as client:
        assert client.recv(1000).startswith(b"HTTP/1.1 401 ")
    upgrade = (b"connection: upgrade", b"upgrade: websocket", b"sec-websocket-version: 13")
    # REST has no websockets, for whoever it may be, and without the pages there are none at all.
    for key, statuses in ((b"eA==", (b"400", b"401")), (b"eHh4eHh4eHh4eHh4eHh4eA==", (b"403", b"401"))):
        for credentials in ((), (good,)):
            asked = (b"host: x", *upgrade, b"sec-websocket-key: " + key, *credentials)
            with raw(site, b"GET /api/v1/groups HTTP/1.1", *asked) as client:
                said = client.recv(1000)
            assert said.startswith(b"HTTP/1.1 ")
            assert said[9:12] in statuses or (credentials and said[9:12] == b"200" and not has_pages())


def test_no_line_of_the_log_has_a_token(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root, level = logging.getLogger(), logging.getLogger().level
    handlers, ours = root.handlers[:], {name: logging.getLogger(name).level for name in ("covista_service",)}
    log_to_stderr("debug", "json", 0)
    try:
        with station(tmp_path) as own:
            stranger, late = new_secret(), own.tokens.add("late", OPERATE)
            shown = [own.reader, stranger, late]
            for token in shown:
                own.get("/api/v1/groups", token)
                own.get(f"/api/v1/robots/{token}?token={token}", token)
                httpx.delete(f"{own.running.url}/api/v1/{token}", headers={"authorization": f"Bearer {token}"})
            own.get("/api/v1/groups", f"{own.reader} and more")
            metrics = own.get("/metrics", own.reader).text
    finally:
        root.handlers[:] = handlers
        root.setLevel(level)
        for name, before in ours.items():
            logging.getLogger(name).setLevel(before)
    lines = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    # The client is in this process too, and tells of what it asks for.
    own_lines = [line for line in lines if not line["logger"].startswith(("httpx", "httpcore"))]
    assert sum(line["message"] == "refused" for line in own_lines) >= 4
    log = json.dumps(own_lines)
    for token in shown:
        assert token.removeprefix("covista_") not in log
        assert token.removeprefix("covista_") not in metrics
