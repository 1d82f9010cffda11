"""Who comes to which page, and by what: sessions, tokens, pages of somebody else, paths that only look open."""

import pytest
from covista_service.access import Scope
from covista_service.access.tokens import new_secret
from covista_service.dashboard.places import PAGES

from tests.service.dashboard.front import HOST, OTHERS, OWN, SOCKET, Front, locked, says
from tests.service.dashboard.test_log_in import session_of

FILES = ("/log-in", "/files/covista.css", "/_nicegui/3.18.0/static/vue.js")
INSIDE = (
    "",
    "/",
    "/similarity",
    "/pairs/r1/r2",
    "/nothing",
    "/log-in/",
    "/log-in/x",
    "/session/end",
    "/_nicegui",
    "/files",
)
HERE = {"host": HOST, "origin": f"http://{HOST}"}


def logged_in(scope: Scope = Scope.READ) -> tuple[Front, str]:
    front, reader, operator = locked()
    return front, session_of(front.log_in(reader if scope is Scope.READ else operator))


@pytest.mark.parametrize("path", FILES)
def test_what_tells_nothing_of_the_robots_is_open(path: str) -> None:
    front, _, _ = locked()
    for headers in ({}, OWN, OTHERS):
        assert front.page(path, **headers).status_code == 200
    assert front.gate.refused.total() == 0


@pytest.mark.parametrize("path", INSIDE)
def test_all_else_leads_who_has_no_session_to_the_form_whether_it_is_there_or_not(path: str) -> None:
    front, _, _ = locked()
    for session in ("", "x", new_secret()):
        answer = front.page(path, session)
        assert answer.status_code == 303
        assert answer.headers["location"] == f"/dashboard/log-in?next={path or '/'}"


def test_to_open_many_pages_before_logging_in_is_no_failure() -> None:
    front, reader, _ = locked()
    front = Front(shelf=front.shelf, most=2)
    assert {front.page("/").status_code for _ in range(20)} == {303}
    assert {front.page("/data/session").status_code for _ in range(20)} == {401}
    assert front.log_in(new_secret()).status_code == 401
    assert front.log_in(reader).status_code == 303


def test_the_way_back_has_all_of_the_address() -> None:
    front, _, _ = locked()
    answer = front.page("/timeline?at=2026-01-01T00:00:00%2B01:00&robot=r1")
    _, _, back = answer.headers["location"].partition("next=")
    assert back == "/timeline%3Fat%3D2026-01-01T00%3A00%3A00%252B01%3A00%26robot%3Dr1"
    form = front.page(f"/log-in?next={back}").text
    assert 'name="next" value="/timeline?at=2026-01-01T00:00:00%2B01:00&amp;robot=r1"' in form
    assert front.page("/timeline", method="POST").headers["location"] == "/dashboard/log-in?next=/"


def test_scripts_and_sockets_hear_why_they_stay_out_instead_of_a_form() -> None:
    front, _, _ = locked()
    for path in ("/data/session", "/data/swarm", "/_nicegui_ws/socket.io/"):
        answer = front.page(path)
        assert answer.status_code == 401
        assert answer.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize(
    "path",
    [
        "//dashboard/log-in",
        "/dashboard//log-in",
        "/dashboard/files/../data/swarm",
        "/DASHBOARD/log-in",
        "/dashboard/LOG-IN",
        "/dashboard/log-in;x",
        "/dashboardx/files/",
        "/dashboard/_niceguix/",
        "/dashboard/x/_nicegui/",
        "/dashboard/log-in\n",
    ],
)
def test_what_only_looks_open_is_closed(path: str) -> None:
    wanted = PAGES.wanted_scope(path) if PAGES.holds(path) else Scope.READ
    # What goes on to a folder of files is looked for there and nowhere else.
    assert wanted is Scope.READ or path.startswith("/dashboard/files/")


def test_encoded_paths_are_judged_as_what_they_mean() -> None:
    front, session = logged_in()
    for path in ("/%64ata/session", "/data%2Fsession"):
        assert front.page(path).status_code == 401
        assert front.page(path, session).status_code == 200


def test_a_session_reads_and_changes_as_its_scope_allows_for_our_own_pages_alone() -> None:
    front, reader = logged_in()
    cookie = {"cookie": f"covista_session={reader}"}
    assert front.get("/groups", **cookie, **OWN).status_code == 200
    assert front.send("PATCH", "/settings", {"alpha": 0.4}, **cookie, **OWN).status_code == 403
    front, operator = logged_in(Scope.OPERATE)
    cookie = {"cookie": f"covista_session={operator}"}
    for headers in (OTHERS, {"sec-fetch-site": "same-site"}, {"origin": "https://elsewhere"}, {"origin": "null"}):
        assert front.send("PATCH", "/settings", {"alpha": 0.4}, **cookie, **headers).status_code == 403
        assert front.gate.refused["scope"] == 0
    assert front.send("PATCH", "/settings", {"alpha": 0.4}, **cookie, **OWN).status_code == 200


def test_a_link_from_elsewhere_leads_to_a_page_but_no_script_there_reads_it() -> None:
    front, session = logged_in()
    link = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}
    assert front.page("/pairs/r1/r2", session, **link).status_code == 200
    assert front.page("/pairs/r1/r2", session, "POST", **link).status_code == 403
    for mode in ("cors", "no-cors", "same-origin"):
        asked = {"sec-fetch-site": "cross-site", "sec-fetch-mode": mode}
        assert front.page("/data/session", session, **asked).status_code == 403


def test_a_token_goes_before_a_session_and_a_bad_one_is_not_made_good_by_it() -> None:
    front, session = logged_in(Scope.OPERATE)
    assert front.page("/", session, authorization=f"Bearer {new_secret()}").status_code == 401
    reader = front.shelf.add("other", Scope.READ)  # type: ignore[union-attr]
    front.keyring.take(front.shelf.read())  # type: ignore[union-attr]
    shown = {"cookie": f"covista_session={session}", "authorization": f"Bearer {reader}"}
    assert front.send("PATCH", "/settings", {"alpha": 0.4}, **shown).status_code == 403


def test_head_needs_what_get_does() -> None:
    front, session = logged_in()
    assert front.page("/", method="HEAD").status_code == 303
    assert front.page("/", session, "HEAD").status_code == 200
    assert front.page("/", method="OPTIONS").status_code == 303


def test_the_first_token_locks_pages_that_were_open() -> None:
    front, _, _ = locked()
    shelf = front.shelf
    front = Front()
    assert front.page("/", host="localhost").status_code == 200
    assert front.page("/data/session", host="localhost").json() == {"station": "test", "name": None, "operates": True}
    assert shelf is not None
    front.keyring.take(shelf.read())
    assert front.page("/", host="localhost").status_code == 303
    assert front.page("/data/session", host="localhost").status_code == 401


def test_an_open_station_shows_its_pages_under_no_name_of_somebody_else() -> None:
    front = Front()
    assert front.page("/", host="elsewhere.example").status_code == 403
    assert front.talk(says("x"), host="elsewhere.example", origin="http://elsewhere.example")[0]["code"] == 1008
    assert front.page("/data/swarm", host="localhost", **OTHERS).status_code == 403


def test_a_page_with_a_session_talks_over_a_socket() -> None:
    front, session = logged_in()
    heard = front.talk(says("hello"), cookie=f"covista_session={session}", **HERE)
    assert [each["type"] for each in heard] == ["websocket.accept", "websocket.send"]


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://elsewhere"},
        {},
        {"origin": "null"},
        {"origin": f"http://{HOST}", "sec-fetch-site": "same-site"},
        {"origin": f"http://{HOST}.elsewhere"},
        {"origin": f"http://{HOST}:81"},
    ],
)
def test_no_page_of_somebody_else_opens_a_socket_with_a_session(headers: dict[str, str]) -> None:
    front, session = logged_in()
    heard = front.talk(says("hello"), cookie=f"covista_session={session}", host=HOST, **headers)
    assert heard == [{"type": "websocket.close", "code": 1008}]


def test_no_socket_opens_without_a_session_or_anywhere_else() -> None:
    front, session = logged_in()
    for cookie in ("", "covista_session=x"):
        assert front.talk(says("hello"), cookie=cookie, **HERE) == [{"type": "websocket.close", "code": 1008}]
    for path in ("/dashboard/", "/api/v1/events", "/_nicegui_ws/socket.io/"):
        heard = front.talk(says("hello"), path=path, cookie=f"covista_session={session}", **HERE)
        assert heard == [{"type": "websocket.close", "code": 1008}]


@pytest.mark.parametrize("ended_by", ["revoked", "log out"])
def test_a_socket_ends_with_the_session_that_opened_it(ended_by: str) -> None:
    front, session = logged_in()

    def end() -> None:
        if ended_by == "revoked":
            front.revoke("reader")
        else:
            front.gate.sessions.end(session)

    heard = front.talk(says("one"), end, says("two"), says("three"), cookie=f"covista_session={session}", **HERE)
    assert [each.get("text", each.get("code")) for each in heard] == [None, "one", 1008]


def test_a_socket_of_an_open_station_ends_when_the_first_token_is_made() -> None:
    front, _, _ = locked()
    shelf, front = front.shelf, Front()
    assert shelf is not None
    here = {"host": "localhost", "origin": "http://localhost"}
    heard = front.talk(says("one"), lambda: front.keyring.take(shelf.read()), says("two"), **here)
    assert [each.get("text", each.get("code")) for each in heard] == [None, "one", 1008]
    assert SOCKET.startswith("/dashboard/_nicegui_ws/")
