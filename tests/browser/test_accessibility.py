"""Every page by the rules of axe, light and dark, wide and narrow; and no page wider than a phone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.browser.conftest import LockedStation
from tests.browser.pages import await_groups, opened
from tests.browser.places import PAGES
from tests.browser.visitor import PHONE, WIDE, Visitor

pytest.importorskip("axe_playwright_python")

from axe_playwright_python.sync_playwright import Axe

if TYPE_CHECKING:
    from playwright.sync_api import Page

SIZES = {"wide": WIDE, "phone": PHONE}
# What is folded up is held to the same.
OPEN_ALL = "document.querySelectorAll('details').forEach((each) => (each.open = true))"
OVERFLOW = "document.documentElement.scrollWidth - document.documentElement.clientWidth"


def serious(page: Page) -> list[str]:
    """What axe finds that keeps people out: the rule, and where."""
    found: list[dict[str, Any]] = Axe().run(page).response["violations"]
    return [
        f"{each['id']}: {node['html'][:200]} {node.get('failureSummary', '')}"
        for each in found
        if each["impact"] in ("serious", "critical")
        for node in each["nodes"]
    ]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_axe_finds_nothing_serious_and_no_page_is_too_wide(visitor: Visitor, size: str, dark: bool) -> None:
    page = visitor.page(dark=dark, size=SIZES[size])
    found: dict[str, list[str]] = {}
    for address, heading in PAGES.items():
        opened(page, address, heading)
        if heading == "Swarm":
            await_groups(page, 2)
        page.evaluate(OPEN_ALL)
        found[heading] = serious(page)
        if page.evaluate(OVERFLOW) > 0:
            found[heading].append("wider than the window")
    assert not any(found.values()), found


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_the_question_before_settings_are_applied_is_held_to_the_same(visitor: Visitor, dark: bool) -> None:
    page = visitor.page(dark=dark, size=PHONE)
    opened(page, "/dashboard/what-if?groups=3", "What if")
    page.get_by_role("button", name="Apply ...").click()
    page.get_by_role("dialog").wait_for()
    assert serious(page) == []
    assert page.evaluate(OVERFLOW) <= 0


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_the_form_to_log_in_is_held_to_the_same(
    stranger: Visitor, locked: LockedStation, size: str, dark: bool
) -> None:
    stranger.allow(r"401")
    page = stranger.page(dark=dark, size=SIZES[size])
    page.goto("/dashboard/log-in")
    assert serious(page) == []
    page.get_by_label("Token").fill("x")
    page.get_by_role("button").click()
    page.get_by_role("alert").wait_for()
    assert serious(page) == []
    assert page.evaluate(OVERFLOW) == 0
