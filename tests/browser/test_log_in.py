"""Logging in with a token, in a browser: who comes in, what that allows, and what it leaves behind."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from covista_service.access import Scope
from covista_service.access.sessions import COOKIE
from covista_service.access.tokens import new_secret

from tests.browser.conftest import LockedStation
from tests.browser.pages import notice, stands
from tests.browser.stations import BrowsedStation, browsed_station
from tests.browser.visitor import Visitor
from tests.system.certificates import issue

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

WANTED = "/dashboard/pairs/r1/r2?at=2026-01-01T00:00:00Z"
PATCH = """async () => {
    const answer = await fetch("/api/v1/settings", {
        method: "PATCH", headers: { "content-type": "application/json" }, body: '{"alpha": 0.4}',
    });
    return answer.status;
}"""


def log_in(page: Page, token: str) -> None:
    page.get_by_label("Token").fill(token)
    page.get_by_role("button", name="Log in").click()


def test_a_bad_token_is_refused_in_words_and_a_good_one_leads_to_the_page_one_wanted(
    stranger: Visitor, locked: LockedStation
) -> None:
    stranger.allow(r"401")
    page = stranger.page()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(WANTED)
    assert page.url.startswith(f"{locked.station.url}/dashboard/log-in?next=")
    assert page.evaluate("document.activeElement.id") == "token"
    bad = new_secret()
    log_in(page, bad)
    page.get_by_role("alert").get_by_text("The station does not know this token.").wait_for()
    assert page.context.cookies() == []
    log_in(page, locked.reader)
    stands(page, "Pair")
    assert page.url == f"{locked.station.url}{WANTED}"
    (cookie,) = page.context.cookies()
    assert (cookie["name"], cookie["httpOnly"], cookie["sameSite"], cookie["secure"]) == (COOKIE, True, "Lax", False)
    assert page.evaluate("document.cookie") == ""
    # A token is sent once, in the body of the form, and kept nowhere.
    kept = page.evaluate("JSON.stringify([{...localStorage}, {...sessionStorage}])") + page.content()
    for text in (*asked, kept, locked.station.log):
        assert locked.reader not in text
        assert bad not in text
    assert cookie["value"] not in locked.station.log


def test_who_may_read_changes_nothing_and_who_may_operate_does(stranger: Visitor, locked: LockedStation) -> None:
    stranger.allow(r"403")
    for token, status in ((locked.reader, 403), (locked.operator, 200)):
        page = stranger.page()
        page.goto("/dashboard/")
        log_in(page, token)
        stands(page, "Swarm")
        assert page.evaluate(PATCH) == status


def test_who_logs_out_is_out_on_all_pages(stranger: Visitor, locked: LockedStation) -> None:
    stranger.allow(r"401")
    page = stranger.page()
    page.goto("/dashboard/health")
    log_in(page, locked.reader)
    stands(page, "Health")
    other = page.context.new_page()
    other.goto("/dashboard/")
    stands(other, "Swarm")
    page.evaluate("sessionStorage.setItem('covista-applied', '[]')")
    page.get_by_role("button", name="Log out reader").click()
    page.get_by_label("Token").wait_for()
    # Who logs in next is not told what was done here, and sees nothing on the other page.
    assert page.evaluate("sessionStorage.getItem('covista-applied')") is None
    notice(other).get_by_text("You are not logged in any more").wait_for()
    other.get_by_role("heading", name="Groups").wait_for(state="hidden")
    other.get_by_role("button", name="Log out").wait_for(state="hidden")
    other.get_by_role("link", name="Log in").click()
    other.get_by_label("Token").wait_for()
    page.go_back()
    assert page.get_by_role("heading", name="Health").count() == 0


def test_a_revoked_token_ends_its_pages_at_once(stranger: Visitor, locked: LockedStation) -> None:
    stranger.allow(r"401", r"WebSocket")
    page = stranger.page()
    token = locked.station.token("passing", Scope.READ)
    page.goto("/dashboard/")
    log_in(page, token)
    stands(page, "Swarm")
    locked.station.revoke("passing")
    notice(page).get_by_text("You are not logged in any more").wait_for()
    page.reload()
    page.get_by_label("Token").wait_for()


def test_no_page_of_somebody_else_logs_a_browser_in(stranger: Visitor, locked: LockedStation) -> None:
    stranger.allow(r"403", r"another host")
    page = stranger.page()
    page.route("http://elsewhere.example/", lambda route: route.fulfill(content_type="text/html", body=FORM))
    page.goto("http://elsewhere.example/")
    page.evaluate(
        "([action, token]) => { const form = document.forms[0]; form.action = action; form.token.value = token; }",
        [f"{locked.station.url}/dashboard/session", locked.reader],
    )
    with page.expect_response(re.compile("/dashboard/session")) as found:
        page.get_by_role("button").click()
    assert found.value.status == 403
    assert page.context.cookies() == []


FORM = '<form method="post"><input name="token"><button>Win</button></form>'


@pytest.fixture(scope="module")
def under_tls(chromium: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[BrowsedStation]:
    folder = tmp_path_factory.mktemp("tls")
    with browsed_station(folder, tls=issue(folder, "station"), rovers=False) as running:
        yield running


def test_under_tls_the_cookie_is_for_tls_alone(browser: Browser, under_tls: BrowsedStation) -> None:
    token = under_tls.token("reader", Scope.READ)
    with Visitor(browser, under_tls.url) as somebody:
        page = somebody.page(ignore_https_errors=True)
        page.goto("/dashboard/similarity")
        log_in(page, token)
        stands(page, "Similarity")
        (cookie,) = page.context.cookies()
        assert cookie["secure"]
        assert cookie["httpOnly"]
        assert not somebody.troubles
