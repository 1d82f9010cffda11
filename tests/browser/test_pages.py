"""What all pages share: they open, by links and by keyboard alone, and ask nobody but the station."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.browser.pages import opened, stands
from tests.browser.places import PAGES, PLACES, TITLES

if TYPE_CHECKING:
    from playwright.sync_api import Page

# More than there are stops before the content of any page.
MOST_STOPS = 12


@pytest.mark.parametrize(("address", "heading"), PAGES.items())
def test_every_page_opens_under_its_own_address_without_an_error(page: Page, address: str, heading: str) -> None:
    opened(page, address, heading)
    assert page.title() == f"{TITLES.get(heading, heading)} - Covista"
    assert page.locator("h1").count() == 1
    assert page.locator("html").get_attribute("lang") == "en-US"


def test_the_root_and_the_prefix_alone_lead_to_the_swarm(page: Page) -> None:
    for address in ("/", "/dashboard"):
        page.goto(address)
        stands(page, "Swarm")
        assert page.url.endswith("/dashboard/")


def test_links_lead_from_every_page_to_every_other(page: Page) -> None:
    opened(page, "/dashboard/robots/r1", "Robot")
    for address, heading in PLACES.items():
        page.get_by_role("navigation", name="Pages").get_by_role("link", name=heading, exact=True).click()
        stands(page, heading)
        assert page.url.endswith(address)
        assert page.locator("nav a[aria-current=page]").all_inner_texts() == [heading]


def test_the_keyboard_alone_leads_from_page_to_page_and_shows_where_it_is(page: Page) -> None:
    opened(page, "/dashboard/", "Swarm")
    for address, heading in list(PLACES.items())[1:]:
        for _ in range(MOST_STOPS):
            page.keyboard.press("Tab")
            stop = page.evaluate("""() => {
                const { outlineStyle, outlineWidth } = getComputedStyle(document.activeElement);
                return [document.activeElement.textContent.trim(), outlineStyle, parseFloat(outlineWidth)];
            }""")
            if stop[0] == heading:
                break
        assert stop[0] == heading
        assert stop[1] != "none"
        assert stop[2] >= 2
        page.keyboard.press("Enter")
        stands(page, heading)
        assert page.url.endswith(address)


def test_the_first_stop_of_the_keyboard_leads_past_what_all_pages_have(page: Page) -> None:
    opened(page, "/dashboard/", "Swarm")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "To the content"
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    assert page.evaluate("document.querySelector('main').contains(document.activeElement)")


def test_dark_is_kept_for_the_next_page(page: Page) -> None:
    opened(page, "/dashboard/", "Swarm")
    before = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.get_by_role("button", name="Switch to dark").click()
    page.wait_for_function("document.body.classList.contains('body--dark')")
    opened(page, "/dashboard/health", "Health")
    page.wait_for_function("document.body.classList.contains('body--dark')")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != before
    page.get_by_role("button", name="Switch to light").wait_for()
