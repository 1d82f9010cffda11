"""What tests look for on pages, by the names under which people and screen readers know it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.browser.places import CONTENT

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page


def opened(page: Page, address: str, heading: str) -> Page:
    """Go to a page and wait until its view and the head of all pages stand, and show what the station has told."""
    page.goto(address)
    stands(page, heading)
    for selector in CONTENT[heading]:
        page.locator(selector).first.wait_for()
    return page


def stands(page: Page, heading: str) -> None:
    """Wait until a page stands."""
    page.get_by_role("heading", level=1, name=heading, exact=True).wait_for()
    page.get_by_role("button", name="Switch to").wait_for()


def notice(page: Page) -> Locator:
    """What the head of a page says of the station, where there is something to say."""
    return page.locator(".cv-standing [role=status]")


def groups_shown(page: Page) -> list[list[str]]:
    """The groups beside the map, in their order."""
    lists = page.locator("section[aria-labelledby=cv-groups] li .cv-members")
    return [each.locator("button").all_inner_texts() for each in lists.all()]


def await_groups(page: Page, count: int) -> None:
    """Wait until so many groups stand beside the map."""
    page.wait_for_function(
        "count => document.querySelectorAll('section[aria-labelledby=cv-groups] li').length === count", arg=count
    )


def await_revision(page: Page, revision: int) -> None:
    """Wait until the map shows these groups, or later ones."""
    page.wait_for_function(
        "revision => Number(document.querySelector('canvas[data-revision]')?.dataset.revision) >= revision",
        arg=revision,
    )
