"""Somebody with a browser, who is told of all that goes wrong on the way."""

from __future__ import annotations

import re
from types import TracebackType
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, Request, Response

WIDE, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}


class Visitor:
    """Opens pages, each as another browser would, and holds them to this: nothing fails, and nobody else is asked.

    `troubles` are a line each; what is to go wrong is named before by `allow`, as a regular expression of the line.
    """

    def __init__(self, browser: Browser, url: str) -> None:
        self.browser = browser
        self._url = url
        self._contexts: list[BrowserContext] = []
        self._allowed: list[re.Pattern[str]] = []
        self._troubles: list[str] = []

    def page(self, *, dark: bool = False, size: dict[str, int] | None = None, **options: Any) -> Page:
        """A page of a browser with no cookies yet; `options` are those of a browser's context."""
        context = self.browser.new_context(
            base_url=self._url,
            viewport=size or WIDE,  # type: ignore[arg-type]
            color_scheme="dark" if dark else "light",
            **options,
        )
        context.set_default_timeout(15_000)
        self._contexts.append(context)
        context.on("console", self._heard)
        context.on("weberror", lambda error: self._note(f"error: {error.error}"))
        context.on("request", self._asks)
        context.on("requestfailed", self._failed)
        context.on("response", self._answered)
        page = context.new_page()
        page.on("websocket", lambda socket: self._goes_to(socket.url))
        return page

    def allow(self, *patterns: str) -> None:
        """Let this go wrong from now on."""
        self._allowed += [re.compile(pattern) for pattern in patterns]

    @property
    def troubles(self) -> list[str]:
        """What went wrong that was not allowed."""
        return [line for line in self._troubles if not any(pattern.search(line) for pattern in self._allowed)]

    def __enter__(self) -> Visitor:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for context in self._contexts:
            context.close()

    def _note(self, line: str) -> None:
        self._troubles.append(line)

    def _heard(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            self._note(f"console {message.type}: {message.text} at {message.location.get('url')}")

    def _asks(self, request: Request) -> None:
        self._goes_to(request.url)

    def _goes_to(self, url: str) -> None:
        asked = urlsplit(url)
        if asked.scheme not in ("data", "blob", "about") and asked.netloc != urlsplit(self._url).netloc:
            self._note(f"another host: {url}")

    def _failed(self, request: Request) -> None:
        # What a page asked for that was left before the answer came.
        if request.failure != "net::ERR_ABORTED":
            self._note(f"failed: {request.method} {request.url}: {request.failure}")

    def _answered(self, response: Response) -> None:
        if response.status >= 400:
            self._note(f"status {response.status}: {response.request.method} {response.url}")
