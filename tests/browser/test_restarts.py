"""Pages while the station is away, after it has come back, and while something stalls; a station of this file's own."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import psutil
import pytest

from tests.browser.pages import await_groups, groups_shown, notice, opened
from tests.browser.stations import BrowsedStation, browsed_station
from tests.browser.visitor import Visitor
from tests.service.deadline import wait_until

if TYPE_CHECKING:
    from playwright.sync_api import Browser

# What a page that asks in vain cannot keep the browser from saying.
AWAY = (r"ERR_CONNECTION_REFUSED", r"ERR_EMPTY_RESPONSE", r"ERR_CONNECTION_RESET", r"ERR_SOCKET_NOT_CONNECTED")
FROZEN = (*AWAY, r"ERR_TIMED_OUT", r"WebSocket")

STALLED_S, STALLED_MB = 20.0, 20.0


@pytest.fixture(scope="module")
def own(chromium: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[BrowsedStation]:
    with browsed_station(tmp_path_factory.mktemp("own")) as running:
        yield running


@pytest.fixture
def guest(browser: Browser, own: BrowsedStation) -> Iterator[Visitor]:
    with Visitor(browser, own.url) as somebody:
        yield somebody
    assert not somebody.troubles


def test_pages_outlive_a_station_that_was_killed_and_say_so(guest: Visitor, own: BrowsedStation) -> None:
    guest.allow(*AWAY, r"WebSocket connection to .* failed")
    swarm, health = guest.page(), guest.page()
    opened(swarm, "/dashboard/", "Swarm")
    opened(health, "/dashboard/health", "Health")
    await_groups(swarm, 2)
    before = groups_shown(swarm)
    own.kill()
    for page in (swarm, health):
        notice(page).get_by_text(re.compile(r"has not answered since .*\. What you see is from before")).wait_for()
    # What was there stays to be read.
    assert groups_shown(swarm) == before
    own.start()
    for page in (swarm, health):
        notice(page).get_by_text("The station has restarted").wait_for()
    await_groups(swarm, 2)
    assert groups_shown(swarm) == before
    notice(swarm).get_by_role("button").click()
    notice(swarm).wait_for(state="detached")


def test_what_was_applied_is_undone_after_a_restart(guest: Visitor, own: BrowsedStation) -> None:
    guest.allow(*AWAY, r"WebSocket connection to .* failed")
    page = guest.page()
    opened(page, "/dashboard/what-if?alpha=0.7", "What if")
    page.get_by_role("button", name="Apply ...").click()
    page.get_by_role("dialog").get_by_role("button", name="Apply", exact=True).click()
    page.get_by_text(re.compile("^Applied at")).wait_for()
    own.stop()
    own.start()
    done = page.get_by_text(re.compile("^Applied at .*, before the station restarted: alpha is 0.7, was 0.5"))
    done.get_by_role("button", name="Undo").click(timeout=30_000)
    page.get_by_text(re.compile("^Undone at .*: alpha is 0.5, was 0.7")).wait_for()
    with own.client() as client:
        assert client.get("/api/v1/settings").json()["alpha"] == 0.5


def test_a_station_that_hangs_is_said_to_be_away_and_then_to_be_there(guest: Visitor, own: BrowsedStation) -> None:
    guest.allow(*FROZEN)
    page = guest.page()
    opened(page, "/dashboard/", "Swarm")
    await_groups(page, 2)
    own.signal(signal.SIGSTOP)
    try:
        notice(page).get_by_text("has not answered").wait_for(timeout=30_000)
    finally:
        own.signal(signal.SIGCONT)
    notice(page).wait_for(state="detached", timeout=30_000)
    await_groups(page, 2)


def test_a_tab_that_stalls_costs_the_station_next_to_nothing_and_comes_back(
    guest: Visitor, own: BrowsedStation, chromium: str
) -> None:
    """All of a browser is stopped, as a laptop is that is closed: it reads nothing, and hangs up nowhere."""
    opened(guest.page(), "/dashboard/", "Swarm")
    station, before = psutil.Process(own.pid), set(psutil.Process().children(recursive=True))
    other = guest.browser.browser_type.launch(executable_path=chromium, args=["--no-sandbox"])
    programs = [each for each in psutil.Process().children(recursive=True) if each not in before]
    assert programs
    with Visitor(other, own.url) as sleeper:
        page = sleeper.page()
        opened(page, "/dashboard/", "Swarm")
        await_groups(page, 2)
        held = station.memory_info().rss
        for each in programs:
            each.suspend()
        try:
            # Longer than the station waits for a socket's answer.
            end_s = time.monotonic() + STALLED_S
            wait_until(lambda: time.monotonic() > end_s, deadline_s=2 * STALLED_S)
            grown_mb = (station.memory_info().rss - held) / 1e6
        finally:
            for each in programs:
                each.resume()
        assert grown_mb <= STALLED_MB
        await_groups(page, 2)
        page.wait_for_function("!document.querySelector('.cv-standing [role=status]')")
    other.close()
