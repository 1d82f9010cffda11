"""The map is moved by pointer, wheel and keys, follows whom one asks, and chooses robots, as lists beside it do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.browser.pages import await_groups, opened

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

expect = pytest.importorskip("playwright.sync_api").expect


@pytest.fixture
def still(page: Page) -> Page:
    """The Swarm page, with r1 in the middle of its map at once and for good: nothing glides."""
    page.emulate_media(reduced_motion="reduce")
    opened(page, "/dashboard/", "Swarm")
    await_groups(page, 2)
    canvas = page.locator(".cv-map canvas")
    before = int(canvas.get_attribute("data-frames") or 0)
    page.get_by_label("Follow").select_option("r1")
    # It is in the middle once the map is drawn anew.
    page.wait_for_function("n => document.querySelector('.cv-map canvas').dataset.frames > n", arg=before)
    return page


def chart(page: Page) -> Locator:
    return page.locator(".cv-map canvas")


def robot(page: Page, name: str) -> Locator:
    return page.locator(".cv-panel").get_by_role("button", name=name, exact=True)


def click_from_middle(page: Page, dx: float, dy: float) -> None:
    box = chart(page).bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] / 2 + dx, box["y"] + box["height"] / 2 + dy)


def test_who_is_followed_stands_in_the_middle_and_is_chosen_by_a_click(still: Page) -> None:
    expect(robot(still, "r1")).to_have_attribute("aria-pressed", "false")
    click_from_middle(still, 0, 0)
    expect(robot(still, "r1")).to_have_attribute("aria-pressed", "true")
    click_from_middle(still, 0, 0)
    expect(robot(still, "r1")).to_have_attribute("aria-pressed", "false")


def test_dragging_moves_the_ground_with_the_pointer_and_follows_nobody(still: Page) -> None:
    chart(still).hover()
    still.mouse.down()
    box = chart(still).bounding_box()
    assert box is not None
    still.mouse.move(box["x"] + box["width"] / 2 + 90, box["y"] + box["height"] / 2 - 40, steps=5)
    still.mouse.up()
    expect(still.get_by_label("Follow")).to_have_value("none")
    # To drag is not to choose.
    expect(robot(still, "r1")).to_have_attribute("aria-pressed", "false")
    click_from_middle(still, 90, -40)
    expect(robot(still, "r1")).to_have_attribute("aria-pressed", "true")


def test_keys_move_and_zoom_the_map_and_show_all_again(still: Page) -> None:
    chart(still).focus()
    still.keyboard.press("ArrowLeft")
    expect(still.get_by_label("Follow")).to_have_value("none")
    click_from_middle(still, 60, 0)
    expect(robot(still, "r1")).to_have_attribute("aria-pressed", "true")
    still.keyboard.press("+")
    # What was 60 px from the middle is a quarter further away.
    click_from_middle(still, 75, 0)
    expect(robot(still, "r1")).to_have_attribute("aria-pressed", "false")
    still.keyboard.press("0")
    expect(still.get_by_label("Follow")).to_have_value("all")
    still.keyboard.press("-")
    expect(still.get_by_label("Follow")).to_have_value("none")


def test_keys_with_alt_are_the_browsers(still: Page) -> None:
    chart(still).dispatch_event("keydown", {"key": "ArrowLeft", "altKey": True})
    chart(still).dispatch_event("keydown", {"key": "ArrowLeft", "ctrlKey": True})
    expect(still.get_by_label("Follow")).to_have_value("r1")
    chart(still).dispatch_event("keydown", {"key": "ArrowLeft"})
    expect(still.get_by_label("Follow")).to_have_value("none")


def test_zooming_keeps_who_is_followed_but_lets_go_of_all(still: Page) -> None:
    chart(still).hover()
    still.mouse.wheel(0, -200)
    still.get_by_role("button", name="Zoom in").click()
    expect(still.get_by_label("Follow")).to_have_value("r1")
    click_from_middle(still, 0, 0)
    expect(robot(still, "r1")).to_have_attribute("aria-pressed", "true")
    still.get_by_label("Follow").select_option("all")
    still.get_by_role("button", name="Zoom out").click()
    expect(still.get_by_label("Follow")).to_have_value("none")


def test_two_who_are_chosen_are_those_that_why_is_told_of(still: Page) -> None:
    robot(still, "r2").click()
    robot(still, "r5").click()
    why = still.get_by_role("region", name="Why?")
    expect(why.get_by_label("Robot")).to_have_value("r2")
    expect(why.get_by_label("and")).to_have_value("r5")
    expect(why).to_contain_text("r2")
    # A third takes the place of the first.
    robot(still, "r3").click()
    expect(robot(still, "r2")).to_have_attribute("aria-pressed", "false")
    expect(why.get_by_label("Robot")).to_have_value("r5")
    expect(why.get_by_role("link", name="What both see")).to_have_attribute("href", "/dashboard/pairs/r5/r3")


def test_who_is_chosen_stands_in_the_address(still: Page) -> None:
    robot(still, "r2").click()
    robot(still, "r5").click()
    still.wait_for_url("**/dashboard/?a=r2&b=r5")
    still.reload()
    expect(robot(still, "r2")).to_have_attribute("aria-pressed", "true")
    expect(still.get_by_role("region", name="Why?").get_by_label("and")).to_have_value("r5")
    # Whom nobody knows nobody can choose.
    still.goto("/dashboard/?a=r2&b=r99")
    expect(robot(still, "r2")).to_have_attribute("aria-pressed", "true")
    still.wait_for_url("**/dashboard/?a=r2")


def test_nothing_lies_on_the_map(still: Page) -> None:
    over = chart(still).evaluate("""canvas => {
        const box = canvas.getBoundingClientRect();
        const spots = [[3, 3], [box.width - 3, 3], [3, box.height - 3], [box.width - 3, box.height - 3]];
        return spots.map(([x, y]) => document.elementFromPoint(box.left + x, box.top + y) === canvas);
    }""")
    assert over == [True] * 4
