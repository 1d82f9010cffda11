"""A browser, and a station for it to visit: a process of its own with six rovers, shared by the tests of this folder.

Tests that change more than they put back, or end the station, take one of their own: `stations.browsed_station`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from covista_service.access import Scope
from covista_service.bench.browsing import BROWSERS, browser_path

from tests.browser.stations import BrowsedStation, browsed_station
from tests.browser.visitor import Visitor

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

# For the first test of a worker, which waits for station and browser too.
_PATIENCE_S = 400


@dataclass(frozen=True)
class LockedStation:
    """A station that asks for tokens, and one of each scope."""

    station: BrowsedStation
    reader: str
    operator: str


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of this folder, and give them, which wait for other programs, more time than others."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.timeout(_PATIENCE_S))
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="package")
def chromium() -> str:
    """The program of a browser; without one there is nothing to test here."""
    for module in ("playwright", "nicegui"):
        if find_spec(module) is None:
            pytest.skip(f"{module} is not installed")
    found = browser_path()
    if found is None:
        pytest.skip(f"no browser is installed: none of {', '.join(BROWSERS)}")
    return found


@pytest.fixture(scope="package")
def station(chromium: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[BrowsedStation]:
    """Open to everybody, with r1 to r6 in two groups."""
    with browsed_station(tmp_path_factory.mktemp("station")) as running:
        yield running


@pytest.fixture(scope="module")
def locked(chromium: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LockedStation]:
    """A station that asks for tokens, without robots."""
    with browsed_station(tmp_path_factory.mktemp("locked"), rovers=False) as running:
        yield LockedStation(running, running.token("reader", Scope.READ), running.token("operator", Scope.OPERATE))


# One a module: while it is there, its event loop is that of this thread, where other tests start their own.
@pytest.fixture(scope="module")
def browser(chromium: str) -> Iterator[Browser]:
    """A browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        try:
            yield browser
        finally:
            browser.close()


@pytest.fixture
def visitor(browser: Browser, station: BrowsedStation) -> Iterator[Visitor]:
    """Somebody who visits the shared station; at the end nothing may have gone wrong that was not allowed."""
    with Visitor(browser, station.url) as somebody:
        yield somebody
    assert not somebody.troubles


@pytest.fixture
def stranger(browser: Browser, locked: LockedStation) -> Iterator[Visitor]:
    """Somebody who visits the locked station, held to the same."""
    with Visitor(browser, locked.station.url) as somebody:
        yield somebody
    assert not somebody.troubles


@pytest.fixture
def page(visitor: Visitor) -> Page:
    """A page of the shared station, empty yet: `page.goto("/dashboard/")`."""
    return visitor.page()
