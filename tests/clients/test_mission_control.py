from collections.abc import Callable, Iterator

import httpx
import pytest
from covista_clients import MissionControl
from covista_schemas.errors import ApiError
from covista_schemas.reports import Problem

from tests.clients import sample


class Station:
    """A station that answers from memory, and remembers what it was asked."""

    def __init__(self) -> None:
        self.requests: list[httpx.Request] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.requests.append(request)
        path = request.url.raw_path.decode().partition("?")[0]
        if path.endswith("/overlay.png"):
            return httpx.Response(200, content=sample.PNG)
        if path in sample.ANSWERS:
            status = 503 if path == "/readyz" else 200
            return httpx.Response(status, content=sample.ANSWERS[path].model_dump_json())
        problem = Problem(title="Unknown", status=404, detail=f"nothing at {path}")
        return httpx.Response(404, content=problem.model_dump_json())


@pytest.fixture
def station() -> Station:
    return Station()


@pytest.fixture
def control(station: Station) -> Iterator[MissionControl]:
    with MissionControl("http://station:8000", "secret", transport=httpx.MockTransport(station)) as control:
        yield control


def test_every_question_has_a_typed_answer(control: MissionControl) -> None:
    assert control.robots() == sample.ROBOTS
    assert control.robot("r1") == sample.ROBOTS.robots[0]
    assert control.pairs() == sample.PAIRS
    assert control.pair("r1", "r2") == sample.PAIR
    assert control.overlay("r1", "r2") == sample.PNG
    assert control.similarity() == sample.SIMILARITY
    assert control.groups() == sample.GROUPS
    assert control.group("g1") == sample.GROUPS.groups[0]
    assert control.health().status == "ready"


def test_not_being_ready_is_an_answer(control: MissionControl) -> None:
    assert control.ready() == sample.STARTING


def test_only_what_was_asked_for_is_sent(control: MissionControl, station: Station) -> None:
    control.pairs()
    control.pairs(robot="r1", min_overlap=0.0)
    control.overlay("r1", "r2", "b")
    assert [dict(request.url.params) for request in station.requests] == [
        {},
        {"robot": "r1", "min_overlap": "0.0"},
        {"side": "b"},
    ]
    assert {request.headers["Authorization"] for request in station.requests} == {"Bearer secret"}


def test_what_a_person_types_stays_one_part_of_the_path(control: MissionControl, station: Station) -> None:
    for typed in ("r 1/../x", "?robot=r1", "..", ""):
        with pytest.raises(ApiError, match="Unknown"):
            control.robot(typed)
    paths = [request.url.raw_path.decode() for request in station.requests]
    assert paths[:2] == ["/api/v1/robots/r%201%2F..%2Fx", "/api/v1/robots/%3Frobot%3Dr1"]


def test_a_problem_is_told_whole(control: MissionControl) -> None:
    with pytest.raises(ApiError) as caught:
        control.robot("nobody")
    error = caught.value
    assert (error.status, error.title, error.detail) == (404, "Unknown", "nothing at /api/v1/robots/nobody")


def refuse(request: httpx.Request) -> httpx.Response:
    raise httpx.ConnectError("refused", request=request)


def time_out(request: httpx.Request) -> httpx.Response:
    raise httpx.ReadTimeout("", request=request)


@pytest.mark.parametrize(
    ("answer", "status", "said"),
    [
        (refuse, None, "no answer from http://station:8000.*refused"),
        (time_out, None, "no answer from .*ReadTimeout"),
        (lambda request: httpx.Response(500, text="<html>"), 500, "answered 500"),
        (lambda request: httpx.Response(502), 502, "answered 502"),
        (lambda request: httpx.Response(307, headers={"Location": "/x"}), 307, "answered 307"),
        (lambda request: httpx.Response(200, text="hello"), None, "does not answer as a station does"),
        (lambda request: httpx.Response(200, json={"revision": "x"}), None, "does not answer as a station does"),
    ],
)
def test_whatever_happens_is_an_api_error(
    answer: Callable[[httpx.Request], httpx.Response], status: int | None, said: str
) -> None:
    control = MissionControl("http://station:8000", transport=httpx.MockTransport(answer))
    with control, pytest.raises(ApiError, match=said) as caught:
        control.groups()
    assert caught.value.status == status


@pytest.mark.parametrize("url", ["station:8000", "", "http://[", "ftp://station"])
def test_an_address_that_is_none_is_an_api_error(url: str) -> None:
    with pytest.raises(ApiError), MissionControl(url) as control:
        control.groups()


def test_a_token_that_cannot_be_sent_is_an_error_of_ours() -> None:
    with pytest.raises(ApiError, match="token"):
        MissionControl(token="schlüssel")
