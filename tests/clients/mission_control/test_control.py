import json
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta, timezone

import httpx
import pytest
from covista_clients import MissionControl
from covista_schemas.errors import ApiError
from covista_schemas.reports import EventKind, GroupBounds, Hysteresis, LiveSettings, Problem

from tests.clients import sample

MOMENT = datetime(2026, 5, 4, 3, 2, 1, tzinfo=UTC)


class Station:
    """A station that answers from memory, and remembers what it was asked."""

    def __init__(self) -> None:
        self.requests: list[httpx.Request] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.requests.append(request)
        path = request.url.raw_path.decode().partition("?")[0]
        if path.endswith("/overlay.png"):
            return httpx.Response(200, content=sample.PNG)
        if path == "/metrics":
            return httpx.Response(200, text="covista_up 1\n")
        if (request.method, path) == ("POST", "/api/v1/groups/preview"):
            return httpx.Response(200, content=sample.PREVIEW.model_dump_json())
        if request.method == "DELETE":
            return httpx.Response(204 if path in sample.ANSWERS else 404)
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
    assert control.groups_at(MOMENT) == sample.GROUPS
    assert control.groups_history() == sample.GROUPS_HISTORY
    assert control.events_history() == sample.EVENTS_HISTORY
    assert control.pair_history("r1", "r2") == sample.PAIR_HISTORY
    assert control.track("r1") == sample.TRACK
    assert control.settings() == control.patch_settings() == sample.GROUPS.settings
    assert control.preview() == sample.PREVIEW
    assert control.health().status == "ready"
    assert control.metrics() == "covista_up 1\n"
    control.forget("r1")


def test_changes_go_as_json_as_they_were_given(control: MissionControl, station: Station) -> None:
    control.patch_settings({"groups": GroupBounds(min=2, max=3)}, hysteresis={"gain": 0.1})
    control.preview(alpha=0.7)
    control.preview(LiveSettings(alpha=0.2, hysteresis=Hysteresis(gain=0.3)), criterion="gain")
    control.forget("r1")
    said = [(request.method, request.url.path, request.content) for request in station.requests]
    assert [(method, path, json.loads(content or "null")) for method, path, content in said] == [
        ("PATCH", "/api/v1/settings", {"groups": {"min": 2, "max": 3}, "hysteresis": {"gain": 0.1}}),
        ("POST", "/api/v1/groups/preview", {"alpha": 0.7}),
        ("POST", "/api/v1/groups/preview", {"alpha": 0.2, "hysteresis": {"gain": 0.3}, "criterion": "gain"}),
        ("DELETE", "/api/v1/robots/r1", None),
    ]


def test_times_go_as_utc(control: MissionControl, station: Station) -> None:
    control.groups_at(MOMENT)
    control.groups_history(MOMENT.replace(tzinfo=None), MOMENT.astimezone(timezone(timedelta(hours=2))), limit=5)
    control.events_history(kind=["join", EventKind.LEAVE], robot="r1", cursor="x")
    control.track("r1", since=MOMENT)
    told = "2026-05-04T03:02:01+00:00"
    assert [list(request.url.params.multi_items()) for request in station.requests] == [
        [("time", told)],
        [("from", told), ("to", told), ("limit", "5")],
        [("cursor", "x"), ("kind", "join"), ("kind", "leave"), ("robot", "r1")],
        [("from", told)],
    ]


def test_pages_are_fetched_when_it_is_their_turn() -> None:
    asked: list[str | None] = []

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request.url.params.get("cursor"))
        following = {None: "a", "a": "b", "b": None}[asked[-1]]
        page = sample.EVENTS_HISTORY.model_copy(update={"next": following})
        return httpx.Response(200, content=page.model_dump_json())

    with MissionControl(transport=httpx.MockTransport(answer)) as control:
        pages = control.pages(control.events_history, kind="join", limit=5)
        assert asked == []
        assert next(pages).next == "a"
        assert asked == [None]
        assert [page.next for page in pages] == ["b", None]
    assert asked == [None, "a", "b"]


def test_a_list_that_leads_to_itself_is_an_error() -> None:
    page = sample.ROBOTS.model_copy(update={"next": "a"}).model_dump_json()
    transport = httpx.MockTransport(lambda request: httpx.Response(200, content=page))
    with MissionControl(transport=transport) as control, pytest.raises(ApiError, match="no end"):
        list(control.pages(control.robots))


@pytest.mark.parametrize("what", ["groups", "similarity"])
def test_what_still_stands_is_not_sent_again(what: str) -> None:
    reports = {"groups": sample.GROUPS, "similarity": sample.SIMILARITY}
    tags = ['"1"', '"1"', '"2"', None, None]
    known: list[str | None] = []

    def answer(request: httpx.Request) -> httpx.Response:
        tag, given = tags[len(known)], request.headers.get("If-None-Match")
        known.append(given)
        if tag is not None and given == tag:
            return httpx.Response(304, headers={"ETag": tag})
        report = reports[what].model_copy(update={"revision": len(known)})
        return httpx.Response(200, content=report.model_dump_json(), headers={"ETag": tag} if tag else {})

    with MissionControl(transport=httpx.MockTransport(answer)) as control:
        revisions = [getattr(control, what)().revision for _ in tags]
    assert known == [None, '"1"', '"1"', '"2"', '"2"']
    assert revisions == [1, 1, 3, 4, 5]


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


def test_only_what_says_so_is_unchanged() -> None:
    """304 to whoever has nothing would be no answer."""
    transport = httpx.MockTransport(lambda request: httpx.Response(304))
    with MissionControl(transport=transport) as control, pytest.raises(ApiError, match="answered 304"):
        control.groups()


@pytest.mark.parametrize("url", ["station:8000", "", "http://[", "ftp://station"])
def test_an_address_that_is_none_is_an_api_error(url: str) -> None:
    with pytest.raises(ApiError), MissionControl(url) as control:
        control.groups()


def test_a_token_that_cannot_be_sent_is_an_error_of_ours() -> None:
    with pytest.raises(ApiError, match="token"):
        MissionControl(token="schlüssel")
