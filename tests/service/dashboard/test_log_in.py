"""The form, what it sends, and where one comes from there."""

import re

import httpx
import pytest
from covista_service.access import Keyring
from covista_service.access.sessions import COOKIE
from covista_service.access.tokens import new_secret

from tests.service.dashboard.front import OTHERS, OWN, Front, locked


def session_of(answer: httpx.Response) -> str:
    found = re.match(rf"{COOKIE}=([\w-]+);", answer.headers["set-cookie"])
    assert found
    return found[1]


def test_a_good_token_leads_to_the_page_that_was_wanted_with_a_session() -> None:
    front, reader, _ = locked()
    answer = front.log_in(reader, "/pairs/r1/r2?at=2026-01-01T00:00:00Z", **OWN)
    assert (answer.status_code, answer.headers["location"]) == (
        303,
        "/dashboard/pairs/r1/r2?at=2026-01-01T00:00:00Z",
    )
    flags = {flag.strip().lower() for flag in answer.headers["set-cookie"].split(";")[1:]}
    assert flags == {"httponly", "samesite=lax", "path=/"}
    session = session_of(answer)
    assert reader not in answer.headers["set-cookie"] + answer.headers["location"] + answer.text
    assert front.page("/", session).text == "a page"
    assert front.page("/data/session", session, **OWN).json() == {
        "station": "test",
        "name": "reader",
        "operates": False,
    }


@pytest.mark.parametrize(
    ("token", "said"),
    [
        ("covista_" + 43 * "x", "does not know this token"),
        ("", "no token"),
        ("covista_x", "no token: one looks like"),
        ("<script>alert(1)</script>", "no token: one looks like"),
        (60_000 * "x", "no token: one looks like"),
    ],
)
def test_a_bad_token_is_refused_in_words_without_a_session(token: str, said: str) -> None:
    front, _, _ = locked()
    answer = front.log_in(token, "/health")
    assert answer.status_code == 401
    assert "set-cookie" not in answer.headers
    (alert,) = re.findall(r'<p role="alert">(.*?)</p>', answer.text)
    assert said in alert
    assert "script" not in answer.text
    assert 'name="next" value="/health"' in answer.text
    assert len(front.gate.sessions) == 0


def test_a_revoked_token_is_told_so_and_too_many_wrong_ones_too() -> None:
    front, reader, operator = locked()
    front.revoke("reader")
    assert "This token is revoked" in front.log_in(reader).text
    front = Front(shelf=front.shelf, most=2)
    assert [front.log_in(new_secret()).status_code for _ in range(3)] == [401, 401, 429]
    late = front.log_in(new_secret())
    assert re.search(r"Try again in \d+ s", late.text)
    assert int(late.headers["retry-after"]) > 0
    # Whoever else comes from there, with a good one, comes in.
    assert front.log_in(operator).status_code == 303


def test_before_the_tokens_are_read_nobody_logs_in_and_is_told_to_wait() -> None:
    front, reader, _ = locked()
    front.gate.keyring = Keyring()
    answer = front.log_in(reader)
    assert answer.status_code == 503
    assert "cannot read its tokens now" in answer.text


@pytest.mark.parametrize(
    "back",
    [
        "//elsewhere",
        "https://elsewhere",
        "/\\elsewhere",
        "elsewhere",
        "@elsewhere",
        ".elsewhere",
        "/a//b",
        "/a\r\nset-cookie: a=b",
        '/"><script>',
        "",
        "/" + 600 * "a",
    ],
)
def test_from_the_form_one_comes_to_pages_of_this_station_alone(back: str) -> None:
    front, reader, _ = locked()
    assert front.log_in(reader, back).headers["location"] == "/dashboard/"
    form = front.ask(f"/dashboard/log-in?{httpx.QueryParams({'next': back})}").text
    assert 'name="next" value="/"' in form
    assert "<script" not in form


def test_no_page_of_somebody_else_can_have_a_browser_log_in() -> None:
    front, reader, _ = locked()
    for headers in (OTHERS, {"origin": "http://elsewhere"}, {"sec-fetch-site": "same-site"}, {"origin": "null"}):
        answer = front.log_in(reader, **headers)
        assert answer.status_code == 403
        assert "set-cookie" not in answer.headers
    assert len(front.gate.sessions) == 0
    assert front.gate.refused["origin"] == 4
    for own in ({"origin": "http://station"}, {**OWN, "origin": "null"}, {}):
        assert front.log_in(reader, **own).status_code == 303


def test_a_session_is_new_at_every_log_in_and_the_one_before_ends() -> None:
    front, reader, operator = locked()
    first = session_of(front.log_in(reader))
    # What somebody else has put into the browser is never taken for a session's secret.
    second = session_of(front.log_in(operator, cookie=f"{COOKIE}={first}"))
    planted = session_of(front.log_in(reader, cookie=f"{COOKIE}=planted"))
    assert len({first, second, planted, "planted"}) == 4
    assert front.page("/", first).status_code == 303
    assert front.page("/", second).status_code == 200
    assert front.page("/", "planted").status_code == 303


def test_who_logs_out_is_out_and_no_page_of_somebody_else_can_do_that() -> None:
    front, reader, _ = locked()
    session = session_of(front.log_in(reader))
    assert front.page("/session/end", session, "POST", **OTHERS).status_code == 403
    assert front.page("/", session).status_code == 200
    answer = front.page("/session/end", session, "POST", **OWN)
    assert answer.headers["location"] == "/dashboard/log-in"
    assert f'{COOKIE}=""' in answer.headers["set-cookie"]
    assert front.page("/", session).headers["location"] == "/dashboard/log-in?next=/"


def test_where_no_token_is_needed_the_form_leads_on() -> None:
    front = Front()
    answer = front.page("/log-in?next=/health", host="localhost")
    assert (answer.status_code, answer.headers["location"]) == (303, "/dashboard/health")
    sent = front.log_in(new_secret(), "/health", host="localhost")
    assert (sent.status_code, sent.headers["location"]) == (303, "/dashboard/health")
    assert "set-cookie" not in sent.headers


def test_the_form_loads_nothing_of_others_and_stands_in_no_frame() -> None:
    front, _, _ = locked()
    answer = front.page("/log-in")
    policy = answer.headers["content-security-policy"]
    assert policy.startswith("default-src 'none'")
    assert "form-action 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    # Without it the browser would not say that the form is ours.
    assert answer.headers["referrer-policy"] == "same-origin"
    assert 'type="password"' in answer.text
