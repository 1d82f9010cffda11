"""Settings are tried without changing anything, applied after a question, and taken back."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Protocol

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page, Route

AS_THEY_ARE = {
    "alpha": 0.5,
    "groups": "auto",
    "min_group_size": 1,
    "sigma": "shared",
    "criterion": "adaptive",
    "grouping": "spectral",
    "hysteresis": {"gain": 0.05, "persistence_s": 5.0, "smoothing": 0.3},
}
FORBIDDEN = {"title": "Forbidden", "status": 403, "detail": "this needs a token of scope operate"}


class Place(Protocol):
    url: str


@pytest.fixture(autouse=True)
def put_back(page: Page, station: Place) -> Iterator[None]:
    """Leave the station as it was."""
    yield
    assert page.request.patch(f"{station.url}/api/v1/settings", data=AS_THEY_ARE).ok


def tried(page: Page, query: str = "") -> Page:
    page.goto(f"/dashboard/what-if{query}")
    page.get_by_role("heading", name="Groups", exact=True).wait_for()
    return page


def settings(page: Page, station: Place) -> dict[str, Any]:
    found: dict[str, Any] = page.request.get(f"{station.url}/api/v1/settings").json()
    return found


def changed(page: Page, station: Place, **patch: object) -> None:
    assert page.request.patch(f"{station.url}/api/v1/settings", data=patch).ok


def setting(page: Page, name: str) -> Locator:
    return page.locator(f'[data-setting="{name}"]')


def say(page: Page, name: str, text: str, label: str = "") -> None:
    """Type a number."""
    box = setting(page, name).get_by_role("textbox", name=label).first
    box.fill(text)
    box.press("Enter")


def said(page: Page, words: str) -> None:
    page.get_by_text(re.compile(words)).first.wait_for()


def members(page: Page, side: str) -> list[str]:
    """Who stands in each row on one side, in order."""
    cells = page.locator(f'td[data-side="{side}"]').all()
    return [" ".join(cell.get_by_role("link").all_inner_texts()) for cell in cells]


def confirm(page: Page, action: str) -> None:
    page.get_by_role("dialog").get_by_role("button", name=action, exact=True).click()
    page.get_by_role("dialog").wait_for(state="hidden")


def test_nothing_changes_until_it_is_applied_and_undo_brings_it_back(page: Page, station: Place) -> None:
    tried(page)
    said(page, "^Move a slider or choose another value: .* Nothing changes until you press Apply")
    before = members(page, "now")
    assert len(before) == 2
    setting(page, "groups").get_by_role("combobox").select_option("number")
    say(page, "groups", "3")
    said(page, r"3 groups instead of 2: .*would move")
    then = members(page, "then")
    assert len(then) == 3
    assert sorted(" ".join(then).split()) == sorted(" ".join(before).split())
    assert page.locator("td[data-side=then] .cv-mover").count() >= 1
    assert page.locator("td[data-side=then] small").first.inner_text().startswith("from g")
    assert settings(page, station) == AS_THEY_ARE

    page.get_by_role("button", name="Apply ...").click()
    assert page.get_by_role("dialog").get_by_role("listitem").all_inner_texts() == ["groups is 3, was auto"]
    assert settings(page, station) == AS_THEY_ARE
    confirm(page, "Apply")
    said(page, "^Applied at .*: groups is 3, was auto")
    assert settings(page, station) == AS_THEY_ARE | {"groups": 3}
    page.wait_for_function("document.querySelectorAll('td[data-side=now]').length === 3")
    assert "Applied" in page.evaluate("document.activeElement.textContent")

    page.get_by_role("button", name="Undo").click()
    said(page, "^Undone at .*: groups is auto, was 3")
    assert settings(page, station) == AS_THEY_ARE
    assert page.get_by_role("button", name="Undo").count() == 0


def test_only_what_differs_is_sent(page: Page, station: Place) -> None:
    bodies: list[object] = []
    page.on("request", lambda asked: bodies.append(asked.post_data_json) if asked.method == "PATCH" else None)
    tried(page, "?alpha=0.75&criterion=gain&hysteresis.gain=0.1")
    page.get_by_role("button", name="Apply ...").click()
    confirm(page, "Apply")
    said(page, "^Applied")
    page.get_by_role("button", name="Undo").click()
    said(page, "^Undone")
    assert bodies == [
        {"alpha": 0.75, "criterion": "gain", "hysteresis": {"gain": 0.1}},
        {"alpha": 0.5, "criterion": "adaptive", "hysteresis": {"gain": 0.05}},
    ]


def test_who_leaves_the_question_has_changed_nothing_and_is_back_at_the_button(page: Page, station: Place) -> None:
    tried(page, "?alpha=0.9")
    apply = page.get_by_role("button", name="Apply ...")
    apply.focus()
    page.keyboard.press("Enter")
    page.get_by_role("dialog").wait_for()
    assert page.evaluate("document.activeElement.textContent") == "Leave it"
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="hidden")
    assert page.evaluate("document.activeElement.textContent") == apply.inner_text()
    assert settings(page, station) == AS_THEY_ARE


def test_a_proposal_is_handed_on_by_its_address(page: Page, station: Place) -> None:
    tried(page)
    say(page, "alpha", "0.8")
    setting(page, "groups").get_by_role("combobox").select_option("range")
    say(page, "groups", "4", "At most")
    setting(page, "sigma").get_by_role("combobox").select_option("std")
    said(page, "alpha is 0.8, was 0.5; sigma is std, was shared; groups is 1 to 4, was auto")
    page.wait_for_url("**/what-if?alpha=0.8&sigma=std&groups=1-4")
    page.reload()
    said(page, "alpha is 0.8, was 0.5; sigma is std, was shared; groups is 1 to 4, was auto")
    page.get_by_role("button", name="Back to what is").click()
    page.wait_for_url("**/what-if")
    assert setting(page, "alpha").get_by_role("textbox").input_value() == "0.5"
    assert page.locator("td[data-side=then]").count() == 0


def test_what_an_address_has_no_business_to_say_is_named_and_left_out(page: Page, station: Place) -> None:
    tried(page, "?alpha=7&colour=%3Cimg%20src%3Dx%3E&sigma=2.5")
    said(page, "it was left out: alpha=7, colour=<img src=x>")
    said(page, "^sigma is 2.5, was shared$")
    assert page.locator("img").count() == 0


def test_numbers_out_of_bounds_go_no_further(page: Page, station: Place) -> None:
    tried(page)
    for text in ("1.5", "much", ""):
        say(page, "alpha", text)
        assert setting(page, "alpha").get_by_role("alert").inner_text() == "A number from 0 to 1"
    assert page.get_by_role("button", name="Apply ...").is_disabled()
    say(page, "alpha", "0.6")
    assert setting(page, "alpha").get_by_role("alert").count() == 0
    said(page, "^alpha is 0.6, was 0.5$")


def test_sliders_go_by_keyboard_and_a_ride_asks_the_station_seldom(page: Page, station: Place) -> None:
    tried(page)
    bodies: list[object] = []
    page.on("request", lambda asked: bodies.append(asked.post_data_json) if "preview" in asked.url else None)
    slider = setting(page, "alpha").get_by_role("slider")
    slider.focus()
    for _ in range(30):
        page.keyboard.press("ArrowRight")
    said(page, "^alpha is 0.8, was 0.5$")
    said(page, r"would move\.")
    asked = [body for body in bodies if body]
    assert asked[-1] == {"alpha": 0.8}
    assert len(asked) <= 15


def test_what_others_change_meanwhile_is_told_and_undo_asks(page: Page, station: Place) -> None:
    tried(page, "?alpha=0.7")
    page.get_by_role("button", name="Apply ...").click()
    confirm(page, "Apply")
    said(page, "^Applied")
    assert page.get_by_text("Somebody else has changed settings").count() == 0
    changed(page, station, alpha=0.9, criterion="gain")
    said(page, "Somebody else has changed settings: alpha is 0.9, was 0.7; criterion is gain, was adaptive")
    page.get_by_role("button", name="Seen").click()
    assert page.get_by_text("Somebody else has changed settings").count() == 0
    page.get_by_role("button", name="Undo").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_text("Since you applied yours: alpha is 0.9, was 0.7").wait_for()
    assert dialog.get_by_role("listitem").all_inner_texts() == ["alpha is 0.5, was 0.9"]
    assert settings(page, station)["alpha"] == 0.9
    confirm(page, "Undo all the same")
    said(page, "^Undone")
    assert settings(page, station) == AS_THEY_ARE | {"criterion": "gain"}


def applied(page: Page, query: str, *, done: str = "^Applied") -> Page:
    tried(page, query)
    page.get_by_role("button", name="Apply ...").click()
    confirm(page, "Apply")
    said(page, done)
    return page


def test_undo_outlives_the_page(page: Page, station: Place) -> None:
    applied(page, "?alpha=0.7&hysteresis.gain=0.1")
    applied(page, "?groups=3&alpha=0.9", done="^Applied at .*: alpha is 0.9, was 0.7; groups is 3, was auto")
    page.reload()
    said(page, r"^Applied at [\d:]+: alpha is 0\.9, was 0\.7; groups is 3, was auto")
    page.get_by_role("button", name="Undo").click()
    said(page, "^Undone at .*: alpha is 0.7, was 0.9; groups is auto, was 3")
    page.reload()
    page.get_by_role("button", name="Undo").click()
    said(page, "^Undone at .*: alpha is 0.5, was 0.7; hysteresis.gain is 0.05, was 0.1")
    assert settings(page, station) == AS_THEY_ARE
    tried(page)
    assert page.get_by_role("button", name="Undo").count() == 0
    assert page.get_by_text("Applied at").count() == 0


def test_what_others_have_changed_while_the_page_was_away_is_not_undone(page: Page, station: Place) -> None:
    applied(page, "?alpha=0.7&groups=3")
    page.goto("/dashboard/health")
    changed(page, station, alpha=0.9)
    tried(page)
    said(page, "cannot be undone here any more, for it stands otherwise now: alpha is 0.9, was 0.7")
    assert page.get_by_role("button", name="Undo").count() == 0
    assert settings(page, station) == AS_THEY_ARE | {"alpha": 0.9, "groups": 3}
    page.reload()
    page.get_by_role("heading", name="Groups", exact=True).wait_for()
    assert page.get_by_text("cannot be undone").count() == 0


def test_of_what_was_applied_only_what_still_stands_is_undone(page: Page, station: Place) -> None:
    applied(page, "?alpha=0.7")
    changed(page, station, alpha=0.9)
    said(page, "Somebody else has changed settings")
    setting(page, "criterion").get_by_role("combobox").select_option("gain")
    page.get_by_role("button", name="Apply ...").click()
    confirm(page, "Apply")
    said(page, "^Applied at .*: criterion is gain, was adaptive")
    page.reload()
    page.get_by_role("button", name="Undo").click()
    said(page, "^Undone at .*: criterion is adaptive, was gain")
    assert page.get_by_role("button", name="Undo").count() == 0
    assert settings(page, station) == AS_THEY_ARE | {"alpha": 0.9}


def test_bounds_that_contradict_each_other_are_told_beside_the_form(page: Page, station: Place, visitor: Any) -> None:
    visitor.allow("409")
    tried(page, "?groups=4-2")
    said(page, "These settings contradict each other: .*min must not be larger than max")
    assert page.locator("td[data-side=then]").count() == 0
    say(page, "groups", "2", "At least")
    said(page, r"groups?.*would move\.")
    assert page.get_by_text("contradict").count() == 0


def test_a_note_says_what_so_few_robots_cannot_keep(page: Page, station: Place) -> None:
    tried(page, "?groups=50")
    said(page, "cannot form 50 groups")


def test_what_acts_over_time_is_told_as_such(page: Page, station: Place) -> None:
    tried(page, "?hysteresis.persistence_s=30")
    said(page, r"No preview can show hysteresis\.persistence_s: that acts over time")


def test_who_may_only_look_tries_all_the_same(page: Page, station: Place) -> None:
    def looks_only(route: Route) -> None:
        route.fulfill(json=route.fetch().json() | {"operates": False})

    page.route("**/dashboard/data/session", looks_only)
    tried(page, "?groups=3")
    said(page, "3 groups instead of 2")
    apply = page.get_by_role("button", name="Apply ...")
    assert apply.is_disabled()
    reason = page.locator(f"#{apply.get_attribute('aria-describedby')}").inner_text()
    assert "needs a token of scope operate" in reason


def test_whose_token_no_longer_suffices_is_told_why_nothing_changed(page: Page, station: Place, visitor: Any) -> None:
    def forbidden(route: Route) -> None:
        if route.request.method == "PATCH":
            route.fulfill(status=403, content_type="application/problem+json", body=json.dumps(FORBIDDEN))
        else:
            route.continue_()

    visitor.allow("403")
    page.route("**/api/v1/settings", forbidden)
    tried(page, "?alpha=0.7")
    page.get_by_role("button", name="Apply ...").click()
    confirm(page, "Apply")
    said(page, "^Nothing was changed: this needs a token of scope operate")
    said(page, "^alpha is 0.7, was 0.5$")
    assert settings(page, station) == AS_THEY_ARE


def test_a_station_too_busy_for_previews_says_so_and_is_asked_again(page: Page, station: Place, visitor: Any) -> None:
    busy = {"title": "Too many ask", "status": 503, "detail": "too many ask for what takes long"}
    visitor.allow("503")
    full = "**/groups/preview"
    page.route(full, lambda route: route.fulfill(status=503, json=busy))
    tried(page, "?groups=3")
    said(page, "No preview now: too many ask for what takes long")
    page.unroute(full)
    said(page, "3 groups instead of 2")
    assert page.get_by_text("No preview now").count() == 0


def test_a_station_that_does_not_answer_is_told_at_the_top_and_nothing_breaks(
    page: Page, station: Place, visitor: Any
) -> None:
    asked = re.compile("/api/v1/|/dashboard/data/")
    visitor.allow("^failed: .*(/api/v1/|/dashboard/data/)", "^console error: Failed to load resource")
    tried(page)
    page.route(asked, lambda route: route.abort("connectionrefused"))
    say(page, "alpha", "0.8")
    said(page, "The station has not answered since")
    page.get_by_role("button", name="Apply ...").click()
    confirm(page, "Apply")
    said(page, "^No answer came: look below whether the settings are in force")
    page.unroute(asked)
    said(page, r"would move\.")
    assert settings(page, station) == AS_THEY_ARE


def test_on_a_phone_nothing_is_wider_than_the_page(page: Page, station: Place) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    tried(page, "?groups=2-4&alpha=0.2")
    said(page, r"would move\.")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.get_by_role("button", name="Apply ...").is_visible()
