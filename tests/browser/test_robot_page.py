"""The page of one robot tells what REST tells of it, in words, and what its states are."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import httpx
import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page, Route

expect = pytest.importorskip("playwright.sync_api").expect


def rest(station: Any, path: str) -> Any:
    response = httpx.get(f"{station.url}/api/v1{path}", timeout=10)
    assert response.status_code == 200, response.text
    return response.json()


def opened(page: Page, robot: str = "r1") -> Page:
    page.goto(f"/dashboard/robots/{robot}")
    expect(page.get_by_role("heading", level=2, name=re.compile(f"^{robot}"))).to_be_visible()
    return page


def test_its_view_is_shown_and_asked_for_once_a_keyframe(page: Page) -> None:
    asked: list[str] = []
    words: list[str] = []
    page.on("request", lambda request: asked.append(request.url) if "view.png" in request.url else None)
    page.on("response", lambda answer: words.append(answer.url) if answer.url.endswith("/words") else None)
    opened(page)
    picture = page.get_by_role("img", name="The newest keyframe of r1")
    expect(picture).to_be_visible()
    page.wait_for_function("document.querySelector('img.cv-view')?.naturalWidth >= 320")
    seen = len(words)
    for _ in range(3):
        with page.expect_response("**/robots/r1/words"):
            pass
    assert len(words) > seen
    assert len(asked) == len(set(asked))


def test_neighbours_are_those_that_share_its_view_the_most_first(page: Page, station: Any) -> None:
    opened(page)
    rows = page.locator("section[aria-labelledby=cv-neighbours] tbody tr")
    expect(rows.first).to_be_visible()
    shared = {}
    for pair in rest(station, "/pairs?robot=r1&min_overlap=0.01")["pairs"]:
        other = pair["b"] if pair["a"] == "r1" else pair["a"]
        shared[other] = max(pair["overlap_a"], pair["overlap_b"])
    names = rows.locator("th").all_inner_texts()
    assert set(names) == shared.keys()
    best = max(shared, key=lambda name: shared[name])
    assert shared[names[0]] >= shared[best] - 0.05
    link = rows.first.get_by_role("link", name=f"What r1 and {names[0]} both see")
    expect(link).to_have_attribute("href", re.compile(f"/dashboard/pairs/r1/{names[0]}$"))


def test_neighbours_that_are_silent_are_marked_in_words(page: Page) -> None:
    def answer(route: Route) -> None:
        silent = {"r3": {"status": "stale", "silent_s": 12.3}, "r5": {"status": "gone", "silent_s": None}}
        route.fulfill(json=route.fetch().json() | {"silent": silent})

    page.route("**/robots/r1/words", answer)
    opened(page)
    rows = page.locator("section[aria-labelledby=cv-neighbours] tbody tr")
    expect(rows.first).to_be_visible()
    words = {name.split()[0]: " ".join(name.split()[1:]) for name in rows.locator("th").all_inner_texts()}
    assert words.keys() >= {"r3", "r5"}
    silent = {"r3": "stale, silent for 12 s", "r5": "gone"}
    assert words == {name: silent.get(name, "") for name in words}
    page.unroute_all(behavior="ignoreErrors")


def test_what_it_sends_is_accounted_for(page: Page, station: Any) -> None:
    opened(page)
    accounts = page.locator("section[aria-labelledby=cv-accounts]")
    expect(accounts.locator("dd").nth(1)).to_have_text(re.compile(r"^\d+(\.\d)? a second$"))
    before = rest(station, "/robots/r1")["poses"]["received"]
    row = accounts.locator("tbody tr").filter(has_text="received")
    page.wait_for_function(
        "least => Number(document.querySelector('section[aria-labelledby=cv-accounts] tbody td:last-child')"
        ".textContent.replaceAll(',', '')) > least",
        arg=before,
    )
    assert row.count() == 1


def test_status_group_and_clock_are_told_in_words(page: Page, station: Any) -> None:
    opened(page)
    group = rest(station, "/robots/r1")["group"]
    head = page.locator("section[aria-labelledby=cv-robot-id]")
    expect(head).to_contain_text("r1 is live")
    expect(head).to_contain_text(f"It stands in {group}")
    expect(page.locator("section[aria-labelledby=cv-about]")).to_contain_text("Its clock goes with the station's")


def test_when_it_came_and_went_leads_to_that_time(page: Page) -> None:
    opened(page)
    history = page.locator(".cv-events-list li").filter(has_text="r1 is live")
    expect(history.first).to_be_visible()
    history.first.get_by_role("link").click()
    expect(page).to_have_url(re.compile(r"/dashboard/timeline\?time="))
    expect(page.get_by_role("button", name="Back to now")).to_be_visible()


@pytest.mark.parametrize(
    ("robot", "words"),
    [("r99", "No robot r99 is known now."), ("R1", "is no id of a robot"), ("%3Cb%3Ex", "<b>x is no id")],
)
def test_a_robot_that_is_not_there_is_told_in_a_sentence(page: Page, robot: str, words: str) -> None:
    page.goto(f"/dashboard/robots/{robot}")
    expect(page.get_by_text(words)).to_be_visible()
    expect(page.get_by_role("main").get_by_role("link", name="The swarm")).to_have_attribute(
        "href", re.compile("/dashboard/$")
    )


def test_a_phone_shows_it_all_without_scrolling_sideways(page: Page) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    opened(page)
    expect(page.get_by_role("img", name="The newest keyframe of r1")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
