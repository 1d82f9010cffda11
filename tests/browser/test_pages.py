"""What all pages share: they open, by links and by keyboard alone, and ask nobody but the station."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.browser.places import PAGES, PLACES

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.mark.parametrize(("address", "heading"), PAGES.items())
def test_every_page_opens_under_its_own_address_without_an_error(page: Page, address: str, heading: str) -> None:
    page.goto(address)
    page.get_by_role("heading", level=1, name=heading).wait_for()
    page.get_by_role("button", name="Light or dark").wait_for()
    assert heading.split()[0] in page.title()
    assert page.locator("h1").count() == 1


def test_links_lead_from_every_page_to_every_other(page: Page) -> None:
    page.goto("/dashboard/robots/r1")
    for address, heading in PLACES.items():
        page.get_by_role("navigation", name="Pages").get_by_role("link", name=heading, exact=True).click()
        page.get_by_role("heading", level=1, name=heading, exact=True).wait_for()
        assert page.url.endswith(address)
        assert page.locator("nav a[aria-current=page]").all_inner_texts() == [heading]
