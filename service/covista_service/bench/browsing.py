"""Somebody who looks at the dashboard: a page in a browser, as a process. Needs Playwright and a browser."""

from __future__ import annotations

import shutil
import threading
import time
from dataclasses import dataclass
from queue import SimpleQueue
from typing import TYPE_CHECKING

from covista_service.demo.children import Line, end_soon

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

# Under these names systems have it.
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_WIDTH_PX, _HEIGHT_PX = 1280, 800
_OPEN_MS = 30_000
_FRAMES = "() => Number(document.querySelector('.cv-map canvas')?.dataset.frames ?? 0)"


@dataclass(frozen=True, slots=True)
class BrowsingOptions:
    """The page at `path` of the station at `url`."""

    url: str
    path: str


@dataclass(frozen=True, slots=True)
class Seen:
    """How often the page has drawn its map since it was opened, and when that was counted."""

    at_s: float
    frames: int


def browser_path() -> str | None:
    """A browser of this machine."""
    return next((found for name in BROWSERS if (found := shutil.which(name))), None)


def play(line: Line, options: BrowsingOptions) -> None:
    """Open the page, and answer every word with what is seen; close when the line does."""
    from playwright.sync_api import sync_playwright

    orders: SimpleQueue[object] = SimpleQueue()

    def hear() -> None:
        while (order := line.receive()) is not None:
            orders.put(order)
        end_soon()
        orders.put(None)

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path(), args=["--no-sandbox"])
        page = _opened(browser, f"{options.url}{options.path}")
        line.send(_seen(page))
        threading.Thread(target=hear, name="orders", daemon=True).start()
        while orders.get() is not None:
            line.send(_seen(page))
        browser.close()


def _opened(browser: Browser, url: str) -> Page:
    """The page, once it shows something."""
    page = browser.new_page(viewport={"width": _WIDTH_PX, "height": _HEIGHT_PX})
    page.goto(url, timeout=_OPEN_MS)
    page.wait_for_selector("main h1", timeout=_OPEN_MS)
    return page


def _seen(page: Page) -> Seen:
    return Seen(time.monotonic(), int(page.evaluate(_FRAMES)))
