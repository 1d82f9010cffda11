"""What is asked again, what is not, and what a refusal says."""

import itertools
import socket
import ssl
import threading
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import httpx
import pytest
from covista_clients import MissionControl
from covista_clients.mission_control.connection import ATTEMPTS
from covista_schemas.errors import ApiError, ForbiddenError, TooManyError, UnauthorizedError
from covista_schemas.reports import Problem

from tests.clients import sample

CHANGES: dict[str, Callable[[MissionControl], object]] = {
    "PATCH": lambda control: control.patch_settings(alpha=0.7),
    "DELETE": lambda control: control.forget("r1"),
}


class Wavering:
    """Does these things in turn, the last for ever: a status, or an error of the connection."""

    def __init__(self, *does: int | type[httpx.TransportError], headers: dict[str, str] | None = None) -> None:
        self._does = itertools.chain(does, itertools.repeat(does[-1]))
        self._headers = headers or {}
        self.asked = 0

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.asked += 1
        does = next(self._does)
        if isinstance(does, int):
            content = (
                sample.GROUPS.model_dump_json() if does == 200 else Problem(title="no", status=does).model_dump_json()
            )
            return httpx.Response(does, content=content, headers=self._headers)
        raise does("broken", request=request)

    def control(self, timeout_s: float = 10.0) -> MissionControl:
        return MissionControl("http://station:8000", transport=httpx.MockTransport(self), timeout_s=timeout_s)


@pytest.mark.parametrize(
    "fails", [502, 503, 504, httpx.ConnectError, httpx.ReadError, httpx.ReadTimeout, httpx.RemoteProtocolError]
)
def test_a_question_is_asked_again(fails: int | type[httpx.TransportError]) -> None:
    station = Wavering(fails, fails, 200)
    with station.control() as control:
        assert control.groups() == sample.GROUPS
    assert station.asked == 3


@pytest.mark.parametrize("fails", [400, 404, 409, 422, 429, 500, 501, httpx.UnsupportedProtocol])
def test_what_will_not_change_is_not_asked_again(fails: int | type[httpx.TransportError]) -> None:
    station = Wavering(fails, 200)
    with station.control() as control, pytest.raises(ApiError):
        control.groups()
    assert station.asked == 1


def test_asking_again_has_an_end() -> None:
    station = Wavering(503)
    with station.control() as control, pytest.raises(ApiError, match="no") as caught:
        control.groups()
    assert caught.value.status == 503
    assert station.asked == ATTEMPTS


@pytest.mark.parametrize("fails", [502, 503, httpx.ConnectError, httpx.ReadError, httpx.RemoteProtocolError])
@pytest.mark.parametrize("method", CHANGES)
def test_a_change_is_sent_once(method: str, fails: int | type[httpx.TransportError]) -> None:
    station = Wavering(fails, 200)
    with station.control() as control, pytest.raises(ApiError):
        CHANGES[method](control)
    assert station.asked == 1


def test_a_preview_is_asked_again_only_if_nothing_arrived() -> None:
    station = Wavering(httpx.ConnectError, httpx.ConnectTimeout, 200)
    with station.control() as control:
        control.preview(alpha=1)
    assert station.asked == 3
    for fails in (httpx.ReadError, 503):
        station = Wavering(fails, 200)
        with station.control() as control, pytest.raises(ApiError):
            control.preview(alpha=1)
        assert station.asked == 1


def test_the_station_says_how_long_to_wait() -> None:
    station, began_s = Wavering(503, 200, headers={"Retry-After": "1"}), time.monotonic()
    with station.control() as control:
        control.groups()
    assert 1 <= time.monotonic() - began_s < 3


@pytest.mark.parametrize("wait", ["3600", "Fri, 01 Jan 2100 00:00:00 GMT"])
def test_nobody_waits_beyond_the_time_there_is(wait: str) -> None:
    station, began_s = Wavering(503, headers={"Retry-After": wait}), time.monotonic()
    with station.control() as control, pytest.raises(ApiError) as caught:
        control.groups()
    assert time.monotonic() - began_s < 1
    assert station.asked == 1
    assert caught.value.retry_after_s is not None
    assert caught.value.retry_after_s > 3000


def test_all_attempts_together_have_the_time_of_one() -> None:
    """At a real port at which nothing is ever answered."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        began_s = time.monotonic()
        url = f"http://127.0.0.1:{silent.getsockname()[1]}"
        with MissionControl(url, timeout_s=0.5) as control, pytest.raises(ApiError, match="no answer"):
            control.groups()
        assert 0.4 < time.monotonic() - began_s < 1.5


@pytest.mark.parametrize(
    ("status", "kind", "ask", "said"),
    [
        (401, UnauthorizedError, MissionControl.groups, "GET /api/v1/groups needs a token with scope read: because"),
        (403, ForbiddenError, CHANGES["PATCH"], "PATCH /api/v1/settings needs a token with scope operate: because"),
        (403, ForbiddenError, CHANGES["DELETE"], "DELETE /api/v1/robots/r1 needs a token with scope operate"),
        (401, UnauthorizedError, MissionControl.preview, "POST /api/v1/groups/preview needs a token with scope read"),
        (429, TooManyError, MissionControl.groups, "Slow down: because"),
    ],
)
def test_a_refusal_says_what_is_needed(
    status: int, kind: type[ApiError], ask: Callable[[MissionControl], object], said: str
) -> None:
    problem = Problem(title="Slow down", status=status, detail="because").model_dump_json()
    headers = {"Retry-After": "7"} | ({"WWW-Authenticate": "Bearer"} if status in (401, 403) else {})
    transport = httpx.MockTransport(lambda request: httpx.Response(status, content=problem, headers=headers))
    with MissionControl(token="secret", transport=transport) as control, pytest.raises(kind) as caught:
        ask(control)
    assert str(caught.value).startswith(said)
    assert (caught.value.status, caught.value.retry_after_s) == (status, 7.0)
    assert "secret" not in str(caught.value)


class _Groups(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()
        self.wfile.write(sample.GROUPS.model_dump_json().encode())

    def log_message(self, *arguments: object) -> None:
        """Silence."""


@pytest.fixture
def secured(certificate: tuple[Path, Path]) -> Iterator[str]:
    """Address of a station under TLS."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*certificate)
    with ThreadingHTTPServer(("127.0.0.1", 0), _Groups) as server:
        server.socket = context.wrap_socket(server.socket, server_side=True)
        # A handshake that fails is the point of a test, not an accident.
        server.handle_error = lambda request, client_address: None  # type: ignore[method-assign]
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield f"https://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def test_whom_to_trust_is_told_by_a_file(secured: str, certificate: tuple[Path, Path]) -> None:
    with MissionControl(secured, verify=certificate[0]) as control:
        assert control.groups() == sample.GROUPS
    with MissionControl(secured) as control, pytest.raises(ApiError, match="certificate"):
        control.groups()


def test_a_file_that_tells_of_nobody_is_an_api_error(tmp_path: Path) -> None:
    (tmp_path / "empty.pem").write_text("nothing")
    for name in ("empty.pem", "absent.pem"):
        with pytest.raises(ApiError, match=name):
            MissionControl("https://127.0.0.1", verify=tmp_path / name)


def test_who_is_refused_for_another_reason_is_not_sent_for_a_token() -> None:
    problem = Problem(title="Another host", status=403).model_dump_json()
    transport = httpx.MockTransport(lambda request: httpx.Response(403, content=problem))
    with MissionControl(transport=transport) as control, pytest.raises(ForbiddenError, match="Another host"):
        control.groups()


def test_a_token_from_a_file_may_end_with_its_line() -> None:
    asked: list[str] = []

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request.headers["authorization"])
        return httpx.Response(200, content=sample.ROBOTS.model_dump_json())

    with MissionControl(token=" secret\n", transport=httpx.MockTransport(answer)) as control:
        control.robots()
    assert asked == ["Bearer secret"]


@pytest.mark.parametrize("token", ["sec\nret", "sec\x00ret", "secrét"])
def test_a_token_that_cannot_be_sent_is_not_told(token: str) -> None:
    with pytest.raises(ApiError, match="the token holds what no token holds") as caught:
        MissionControl(token=token)
    assert "sec" not in f"{caught.value}{caught.value.detail}"
