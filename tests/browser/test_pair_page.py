from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

# Without it there is no browser, and nothing to test here.
expect = pytest.importorskip("playwright.sync_api").expect

FACTS = "#cv-facts"


def partners(page: Page) -> tuple[str, str]:
    """Two robots of one group, or any two, of which both have sent keyframes."""
    found = page.request.get("/api/v1/pairs").json()["pairs"]
    seen = [pair for pair in found if pair["keyframes"]]
    best = max(seen, key=lambda pair: (pair["found_by"] == "image", pair["overlap_a"]))
    return best["a"], best["b"]


def plane(support: int, x: float, z: float) -> dict[str, Any]:
    """A plane of a pair, as the station tells it."""
    return {"normal": [x, 0.0, z], "offset_m": 1.5, "support": support, "polygon_a": [], "polygon_b": []}


def opened(page: Page, a: str, b: str) -> Page:
    page.goto(f"/dashboard/pairs/{a}/{b}")
    return page


def test_both_pictures_stand_beside_each_other_with_what_is_known(page: Page) -> None:
    a, b = partners(page)
    opened(page, a, b)
    pictures = page.locator(".cv-picture img")
    expect(pictures).to_have_count(2)
    page.wait_for_function(
        "[...document.querySelectorAll('.cv-picture img')].every((each) => each.complete && each.naturalWidth > 300)"
    )
    expect(pictures.first).to_have_attribute("alt", re.compile(f"keyframe of {a}; what {b} sees"))
    facts = page.locator("section", has=page.locator(FACTS))
    expect(facts).to_contain_text(f"of {a}'s view is seen by {b}")
    expect(facts).to_contain_text(f"of {b}'s view is seen by {a}")
    expect(facts).to_contain_text("Distance")
    expect(page.locator(".cv-picture figcaption").first).to_contain_text("keyframe")


def test_planes_are_listed_with_points_where_pictures_show_them(page: Page) -> None:
    a, b = partners(page)
    told = page.request.get(f"/dashboard/data/pair/look?a={a}&b={b}").json()
    assert [picture["problem"] for picture in told["pictures"]] == [None, None]
    told["pair"]["planes"] = [plane(90, 0.0, 1.0), plane(40, 1.0, 0.0), plane(12, 0.8, 0.6)]
    page.route("**/data/pair/look*", lambda route: route.fulfill(json=told))
    opened(page, a, b)
    rows = page.locator("section", has=page.locator("#cv-planes")).locator("tbody tr")
    expect(rows).to_contain_text(["90", "40", "12"])
    expect(rows).to_contain_text(["level", "upright", "sloping"])
    expect(rows.last).to_contain_text("0.80, 0.00, 0.60")
    told["pair"]["planes"] = []
    expect(page.locator("section", has=page.locator("#cv-planes"))).to_contain_text("None")
    expect(rows).to_have_count(0)


def test_what_pictures_say_of_before_is_told_apart_from_what_is_known_now(page: Page) -> None:
    a, b = partners(page)
    look = page.request.get(f"/dashboard/data/pair/look?a={a}&b={b}").json()
    facts = page.request.get(f"/dashboard/data/pair?a={a}&b={b}").json()
    now = {"overlap_a": 0.881, "overlap_b": 0.7, "found_by": "predicted", "inliers": 116, "outcome": "measured"}
    now |= {"why_not": None, "matched": "When their images were last compared, 116 matched points agreed."}
    look["pair"] |= {"overlap_a": 0.932, "overlap_b": 0.7, "found_by": "image"}
    page.route("**/data/pair/look*", lambda route: route.fulfill(json=look))
    page.route("**/data/pair?*", lambda route: route.fulfill(json=facts | now))
    opened(page, a, b)
    known = page.locator("section", has=page.locator(FACTS))
    expect(known).to_contain_text("Of where the robots stand now. Shares written in the pictures are of when those")
    expect(known).to_contain_text(re.compile(f"88 %.*{a}'s view"))
    expect(known).to_contain_text("When their images were last compared, 116 matched points agreed.")


def test_pictures_are_not_sent_again_while_they_are_the_same(page: Page) -> None:
    a, b = partners(page)
    opened(page, a, b)
    expect(page.locator(".cv-picture img")).to_have_count(2)
    first = page.request.get(f"/dashboard/data/pair/look?a={a}&b={b}").json()
    again = page.request.get(f"/dashboard/data/pair/look?a={a}&b={b}&known={first['version']}").json()
    assert "pictures" in first
    assert ("pictures" in again) == (again["version"] != first["version"])


def test_other_robots_are_chosen_and_the_neighbours_are_links(page: Page) -> None:
    opened(page, "r1", "r2")
    onward = page.locator("a[rel=next]")
    expect(onward).to_contain_text("r1 and r3")
    onward.click()
    page.wait_for_url("**/dashboard/pairs/r1/r3")
    page.get_by_role("combobox", name="and").select_option("r5")
    page.wait_for_url("**/dashboard/pairs/r1/r5")
    page.get_by_role("combobox", name="What").select_option("r5")
    page.wait_for_url("**/dashboard/pairs/r5/r1")
    expect(page.locator(".cv-picture figcaption").first).to_contain_text("r5")


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        ("r1", "nobody", "no robot 'nobody' is known"),
        ("r1", "r1", "r1 makes no pair with itself"),
        ("r1", "R%202", "No robot can be called R 2"),
        ("r1", "%3Cb%3Ex", "No robot can be called <b>x"),
    ],
)
def test_what_is_no_pair_has_a_sentence_instead(page: Page, a: str, b: str, words: str) -> None:
    opened(page, a, b)
    expect(page.get_by_role("alert")).to_contain_text(words)
    expect(page.locator(".cv-picture")).to_have_count(0)


def test_the_past_is_drawn_and_read_with_arrow_keys(page: Page) -> None:
    a, b = partners(page)
    opened(page, a, b)
    for line in (".cv-line-chart .cv-line-a", ".cv-line-chart .cv-line-b"):
        expect(page.locator(line)).to_have_attribute("d", re.compile(r"^M[\d.]+ [\d.]+H"))
    chart = page.locator(".cv-line-chart svg")
    chart.focus()
    page.keyboard.press("ArrowLeft")
    told = page.locator(".cv-moment")
    expect(told).to_contain_text(f"{b} sees")
    kept = page.request.get(f"/api/v1/pairs/{a}/{b}/history?limit=1000").json()["items"]
    expect(told).to_contain_text(re.compile(r"\d+ %|unknown"))
    assert kept
    page.get_by_label("Last").select_option("60")
    expect(page).to_have_url(re.compile("minutes=60"))


@pytest.mark.parametrize("hours", [1, -1])
def test_the_past_ends_now_by_the_clock_of_the_station(page: Page, hours: int) -> None:
    a, b = partners(page)
    page.add_init_script(f"const now = Date.now; Date.now = () => now() + {hours} * 3600000;")
    with page.expect_request("**/history*") as asking:
        page.goto(f"/dashboard/pairs/{a}/{b}?minutes=2")
    (since,) = parse_qs(urlsplit(asking.value.url).query)["from"]
    spent_s = (datetime.now(UTC) - datetime.fromisoformat(since)).total_seconds()
    assert spent_s == pytest.approx(120, abs=30)
    expect(page.locator(".cv-line-chart .cv-line-a")).to_have_attribute("d", re.compile(r"^M[\d.]+ [\d.]+H"))


def test_a_past_that_cannot_be_read_says_so_and_the_rest_stands(page: Page, browser: Browser, station: Any) -> None:
    a, b = partners(page)
    # Somebody else's page: browsers call an answer of 503 an error.
    other = browser.new_page(base_url=station.url)
    problem = {"title": "History unavailable", "status": 503, "detail": "the history cannot be read: its file is gone"}
    other.route("**/history*", lambda route: route.fulfill(status=503, json=problem))
    opened(other, a, b)
    expect(other.get_by_role("alert")).to_contain_text("The past cannot be shown now: the history cannot be read")
    expect(other.locator(FACTS)).to_be_visible()
    expect(other.locator(".cv-picture img")).to_have_count(2)
    other.close()


def test_robots_that_are_gone_are_named_with_how_long(page: Page) -> None:
    a, b = partners(page)
    told = page.request.get(f"/dashboard/data/pair?a={a}&b={b}").json()
    told["robots"][1] |= {"status": "gone", "silent_s": 300.0}
    told["warnings"] = [f"{b} is gone, silent for 5 min: what is told of it is from before."]
    page.route("**/data/pair?*", lambda route: route.fulfill(json=told))
    opened(page, a, b)
    expect(page.locator(".cv-picture .cv-alarm")).to_contain_text("gone, silent for 5 min")
    expect(page.locator(".cv-warning")).to_contain_text(f"{b} is gone")


def test_a_phone_shows_all_without_scrolling_sideways(page: Page) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    opened(page, *partners(page))
    expect(page.locator(".cv-line-chart svg")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
