"""Going back in time shows what was recorded, by every way there is, and leads back to now."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest

from tests.service.deadline import wait_until

if TYPE_CHECKING:
    from playwright.sync_api import Page

expect = pytest.importorskip("playwright.sync_api").expect
WAIT_S = 60.0
GROUPS = ".cv-then-groups li"


def rest(station: Any, path: str, **query: str) -> Any:
    response = httpx.get(f"{station.url}/api/v1{path}", params=query, timeout=10)
    assert response.status_code == 200, response.text
    return response.json()


def set_groups(station: Any, wanted: object) -> None:
    """Have so many groups made, and wait until they are."""
    httpx.patch(f"{station.url}/api/v1/settings", json={"groups": wanted}, timeout=10).raise_for_status()
    wait_until(lambda: wanted == "auto" or len(rest(station, "/groups")["groups"]) == wanted, "groups", WAIT_S)


@pytest.fixture(autouse=True)
def changes(station: Any) -> Iterator[None]:
    """Something to look back on: groups that change, and then are as they were."""
    before = len(rest(station, "/groups")["groups"])
    set_groups(station, 3)
    set_groups(station, 1)
    wait_until(lambda: rest(station, "/groups/history", limit="1000")["items"][-1]["groups"][0]["robots"], "a history")
    yield
    set_groups(station, "auto")
    wait_until(lambda: len(rest(station, "/groups")["groups"]) == before, "as it was", WAIT_S)


def opened(page: Page, query: str = "") -> Page:
    page.goto(f"/dashboard/timeline{query}")
    expect(page.get_by_role("slider", name="Time")).to_be_visible()
    return page


# The address follows within some tenths of a second.
IN_ADDRESS = """() => {
    const slider = document.querySelector(".cv-bands-slider");
    return slider && new URL(location.href).searchParams.get("time") === (slider.dataset.time ?? null);
}"""


def time_of(page: Page) -> str | None:
    """The time in the address, once it is the one that is looked at."""
    page.wait_for_function(IN_ADDRESS)
    return next(iter(parse_qs(urlsplit(page.url).query).get("time", [])), None)


def told(groups: Any) -> list[str]:
    """Groups of REST as the page writes them."""
    named = sorted(groups["groups"], key=lambda each: int(each["label"][1:]))
    return [f"{each['label']} {', '.join(each['robots'])}" for each in named]


def expect_groups(page: Page, groups: Any) -> None:
    lines = [re.compile(r"\s*".join(map(re.escape, line.split()))) for line in told(groups)]
    expect(page.locator(GROUPS).filter(has_not_text="no group")).to_have_text(lines)


def expect_recorded(page: Page, station: Any) -> None:
    """The lists, and the map, show the groups that the station has recorded of the time in the address."""
    time = time_of(page)
    assert time is not None
    recorded = rest(station, "/groups/at", time=time)
    expect(page.locator(".cv-map canvas")).to_have_attribute("data-revision", str(recorded["revision"]))
    expect_groups(page, recorded)


def test_every_event_leads_to_the_groups_as_they_stood_then(page: Page, station: Any) -> None:
    opened(page)
    links = page.locator(".cv-events-list a")
    expect(links.first).to_be_visible()
    seen = set()
    for k in range(min(links.count(), 8)):
        links.nth(k).click()
        expect(links.nth(k)).to_have_attribute("aria-current", "time")
        expect_recorded(page, station)
        seen.add(tuple(page.locator(GROUPS).all_inner_texts()))
    assert len(seen) > 1
    # A link can be opened elsewhere too.
    address, shown = links.nth(1).get_attribute("href"), page.url
    assert address is not None
    page.goto(address)
    expect_recorded(page, station)
    assert shown != page.url


def test_events_are_told_newest_first_and_by_kind(page: Page, station: Any) -> None:
    opened(page)
    expect(page.locator(".cv-events-list li").first).to_be_visible()
    kinds = ["join", "leave", "split", "merge", "moved"]
    recorded = [each["text"] for each in rest(station, "/events/history", limit="1000", kind=kinds)["items"]]  # type: ignore[arg-type]
    page.get_by_role("checkbox", name="Robots").uncheck()
    for text in recorded[-3:]:
        expect(page.locator(".cv-events-list")).to_contain_text(text)
    expect(page.locator(".cv-events-list")).not_to_contain_text("is live")
    page.get_by_role("checkbox", name="Groups").uncheck()
    expect(page.get_by_text("Choose what to show.")).to_be_visible()
    page.get_by_role("checkbox", name="Settings").check()
    expect(page.locator(".cv-events-list li").first).to_contain_text("groups")
    expect(page).to_have_url(re.compile(r"show=Settings(&|$)"))
    newest, *_, oldest = [each["time"] for each in reversed(rest(station, "/events/history", kind="settings")["items"])]
    first, last = (page.locator(".cv-events-list a").nth(k).get_attribute("href") or "" for k in (0, -1))
    assert parse_qs(urlsplit(first).query)["time"] == [newest]
    assert datetime.fromisoformat(oldest) <= datetime.fromisoformat(parse_qs(urlsplit(last).query)["time"][0])


def test_the_slider_goes_back_by_keys(page: Page, station: Any) -> None:
    opened(page)
    slider = page.get_by_role("slider", name="Time")
    expect(slider).to_have_attribute("aria-valuetext", "now")
    slider.focus()
    times = []
    for _ in range(3):
        page.keyboard.press("ArrowLeft")
        expect_recorded(page, station)
        times.append(time_of(page))
    assert times == sorted(set(times), reverse=True)
    page.keyboard.press("ArrowRight")
    expect_recorded(page, station)
    assert time_of(page) == times[1]


def test_dragging_over_the_bands_goes_back_and_live_returns(page: Page, station: Any) -> None:
    opened(page)
    bands = page.get_by_role("img", name=re.compile("^Groups of"))
    box = bands.bounding_box()
    assert box is not None
    y, right = box["y"] + 20, box["x"] + box["width"] - 10
    page.mouse.move(right, y)
    page.mouse.down()
    page.mouse.move(right - 25, y, steps=4)
    page.mouse.up()
    expect(page.get_by_role("button", name="Back to now")).to_be_visible()
    expect_recorded(page, station)
    page.get_by_role("button", name="Live", exact=True).click()
    expect(page.get_by_role("heading", name="Now")).to_be_visible()
    assert time_of(page) is None
    expect_groups(page, rest(station, "/groups"))
    # And it goes on from there.
    before = int(bands.get_attribute("height") or 0)
    set_groups(station, 2)
    expect_groups(page, rest(station, "/groups"))
    newest = rest(station, "/events/history", limit="1000", kind=["split", "merge", "moved"])["items"][-1]  # type: ignore[arg-type]
    expect(page.locator(".cv-events-list")).to_contain_text(newest["text"])
    assert before > 0


def test_who_drags_on_and_on_writes_the_address_now_and_then_and_at_last(page: Page) -> None:
    page.add_init_script("""window.written = 0; const write = history.replaceState.bind(history);
        history.replaceState = (...all) => { window.written += 1; write(...all); }""")
    opened(page)
    slider = page.get_by_role("slider", name="Time")
    before = page.evaluate("written")
    dragged = """async slider => { for (let k = 1; k <= 120; k++) {
        slider.value = Number(slider.max) - k * 1000; slider.dispatchEvent(new Event("input"));
        await new Promise(done => setTimeout(done)); } }"""
    begun = time.monotonic()
    slider.evaluate(dragged)
    last = time_of(page)
    assert last is not None
    assert slider.get_attribute("data-time") == last
    # Each time that it can be, and at the end.
    assert 2 <= page.evaluate("written") - before <= min(100, 2 + (time.monotonic() - begun) / 0.35)


def test_what_is_still_to_come_is_not_shown_as_known(page: Page) -> None:
    opened(page, f"?time={(datetime.now(UTC) + timedelta(hours=2)).strftime('%Y-%m-%dT%H:%M:%SZ')}")
    expect(page.get_by_role("alert")).to_contain_text("still to come")
    expect(page.get_by_role("heading", name="Now")).to_be_visible()
    slider = page.get_by_role("slider", name="Time")
    assert float(slider.get_attribute("max") or "inf") <= 1000 * datetime.now(UTC).timestamp()
    expect(page.locator(GROUPS).first).to_be_visible()
    assert time_of(page) is None


def test_robots_that_are_asked_for_can_be_reached(page: Page) -> None:
    opened(page)
    expect(page.locator(f"{GROUPS} a").first).to_have_attribute("href", re.compile(r"/dashboard/robots/r\d$"))
    page.get_by_text("Pairs in words").click()
    expect(page.locator(".cv-small-matrix li a").first).to_have_attribute(
        "href", re.compile(r"/dashboard/pairs/r\d/r\d$")
    )


def test_times_of_which_nothing_is_known_say_so(page: Page) -> None:
    opened(page, "?time=2001-01-01T00:00:00Z")
    expect(page.get_by_text("Nothing is kept of that time")).to_be_visible()
    expect(page.get_by_text("No groups are kept of this time")).to_be_visible()
    page.get_by_role("button", name="Back to now").click()
    expect(page.locator(GROUPS).first).to_be_visible()
    opened(page, "?time=yesterday")
    expect(page.get_by_role("alert")).to_contain_text("The time in the address is none")
    expect(page.get_by_role("heading", name="Now")).to_be_visible()


def test_spans_are_chosen_zoomed_and_kept_in_the_address(page: Page) -> None:
    opened(page)
    page.get_by_role("button", name="1 h").click()
    page.get_by_role("button", name="Zoom time in").click()
    expect(page.get_by_text("30 min are shown")).to_be_visible()
    expect(page).to_have_url(re.compile(r"span=1800(&|$)"))
    page.reload()
    expect(page.get_by_text("30 min are shown")).to_be_visible()
    page.get_by_role("button", name="5 min").click()
    page.get_by_role("button", name="Earlier").click()
    page.get_by_role("button", name="Later").click()
    expect(page.get_by_role("button", name="Later")).to_be_disabled()


def test_what_is_thinned_or_missing_is_said(page: Page) -> None:
    def told(route: Any) -> None:
        found = route.fetch().json()
        gap = {
            "since_ms": found["until_ms"] - 60_000,
            "until_ms": found["until_ms"] - 30_000,
            "reason": "the disk is full",
        }
        route.fulfill(json={**found, "thinned": True, "gaps": [gap]})

    page.route("**/data/bands*", told)
    opened(page)
    expect(page.get_by_text("So long a time is thinned")).to_be_visible()
    expect(page.get_by_text("something is missing: the disk is full.")).to_be_visible()


def test_a_phone_shows_it_all_without_scrolling_sideways(page: Page) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    opened(page)
    expect(page.locator(".cv-events-list li").first).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
