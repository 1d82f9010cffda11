"""How soon a page shows what the station has published, and that it asks for nothing while nobody looks."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from typing import TYPE_CHECKING

import pytest
from covista_schemas.reports import EventKind

from tests.browser.pages import await_groups, await_revision, groups_shown, opened
from tests.browser.rovers import OTHERS, ROBOTS, TOGETHER
from tests.browser.stations import BrowsedStation
from tests.service.deadline import wait_until

if TYPE_CHECKING:
    from playwright.sync_api import Page

CHANGES, SOON_S = 10, 1.0
# One of them, on a machine that does much else too.
LATEST_S = 2.0
# Longer than anything on the page waits between two questions.
LONG_MS = 3000
# Notes when the map first shows a revision, by the clock that Python has too.
WATCH = """() => {
    const map = document.querySelector("canvas[data-revision]");
    globalThis.shown = {};
    new MutationObserver(() => (globalThis.shown[map.dataset.revision] ??= Date.now() / 1000))
        .observe(map, { attributes: true, attributeFilter: ["data-revision"] });
}"""


@contextmanager
def published(station: BrowsedStation) -> Iterator[dict[int, float]]:
    """When REST's stream of events told of which revision of the groups."""
    told: dict[int, float] = {}
    with station.control() as control, control.events() as events:

        def listen() -> None:
            for event in events:
                if event.event is EventKind.GROUPS and event.revision_after is not None:
                    told[event.revision_after] = time.time()

        thread = threading.Thread(target=listen)
        thread.start()
        try:
            yield told
        finally:
            events.close()
            thread.join(20)
    assert not thread.is_alive()


def test_a_group_change_is_seen_soon_after_it_was_published(page: Page, station: BrowsedStation) -> None:
    opened(page, "/dashboard/", "Swarm")
    await_groups(page, 2)
    page.evaluate(WATCH)
    late: dict[int, float] = {}
    with station.control() as control, published(station) as told:
        for change in range(CHANGES):
            before = control.groups().revision
            control.patch_settings(groups=3 if change % 2 == 0 else "auto")
            revision = wait_until(lambda last=before: max(told, default=0) > last and max(told))
            await_revision(page, revision)
            late[revision] = page.evaluate("revision => shown[revision]", revision) - told[revision]
            await_groups(page, 3 if change % 2 == 0 else 2)
            assert sorted(groups_shown(page)) == sorted(group.robots for group in control.groups().groups)
    in_order = sorted(late.values())
    assert len(in_order) == CHANGES
    assert in_order[-2] <= SOON_S, in_order
    assert in_order[-1] <= LATEST_S, in_order


def test_a_rover_that_leaves_and_comes_is_seen_on_the_page(page: Page, station: BrowsedStation) -> None:
    opened(page, "/dashboard/", "Swarm")
    await_groups(page, 2)
    assert groups_shown(page) == [list(TOGETHER), list(OTHERS)]
    station.rovers.leave("r6")
    missing = page.locator("section[aria-labelledby=cv-missing]").get_by_role("button")
    missing.wait_for()
    assert missing.inner_text() == "r6"
    station.rovers.come("r6")
    missing.wait_for(state="detached")
    assert sorted(chain(*groups_shown(page))) == list(ROBOTS)
    station.settle()


def test_a_hidden_page_asks_for_nothing_until_it_is_looked_at_again(page: Page) -> None:
    asked: list[str] = []
    answered: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    for end in ("requestfinished", "requestfailed"):
        page.on(end, lambda request: answered.append(request.url))  # type: ignore[call-overload]
    page.clock.install()
    opened(page, "/dashboard/", "Swarm")
    await_groups(page, 2)
    before = len(asked)
    page.clock.run_for(LONG_MS)
    page.wait_for_function("() => true")
    assert len(asked) > before
    page.evaluate("""() => {
        globalThis.hiddenNow = true;
        Object.defineProperty(document, "hidden", { get: () => globalThis.hiddenNow });
        document.dispatchEvent(new Event("visibilitychange"));
    }""")
    # What was on its way.
    wait_until(lambda: page.evaluate("1") and len(answered) == len(asked), "all is answered")
    asked.clear()
    page.clock.run_for(LONG_MS)
    page.evaluate("fetch('/dashboard/data/session').then((answer) => answer.status)")
    assert [url for url in asked if not url.endswith("/data/session")] == []
    assert len(asked) == 1
    with page.expect_request("**/data/swarm*"):
        page.evaluate("""() => {
            globalThis.hiddenNow = false;
            document.dispatchEvent(new Event("visibilitychange"));
        }""")


@pytest.fixture(autouse=True)
def as_it_was(station: BrowsedStation) -> Iterator[None]:
    """Groups as they are by themselves, for whoever comes next."""
    yield
    with station.control() as control:
        control.patch_settings(groups="auto")
    station.settle()
