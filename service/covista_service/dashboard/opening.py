"""Starts what serves the pages when somebody opens the first of them: without, a station is up sooner, and smaller."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from covista_service.dashboard.places import has_pages

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Receive, Scope, Send

log = logging.getLogger(__name__)
# NiceGUI has one application a process, in one event loop.
_turn = threading.Lock()
_making = threading.Lock()
_made: list[ASGIApp] = []
_opening: list[_Opening] = []


class _Opening:
    """NiceGUI's time in one event loop: from the first page that is asked for to the end of the station."""

    def __init__(self) -> None:
        self.loop = asyncio.get_running_loop()
        self._wanted, self._over = asyncio.Event(), asyncio.Event()
        self._up: asyncio.Future[None] = self.loop.create_future()

    async def up(self) -> None:
        """Returns when it works. Raises what kept it from that."""
        self._wanted.set()
        await asyncio.shield(self._up)

    def end(self) -> None:
        """Have `work` come to its end."""
        self._over.set()
        self._wanted.set()

    async def work(self) -> None:
        """A task of its own: NiceGUI is to be ended by whom it was started."""
        await self._wanted.wait()
        try:
            if self._over.is_set():
                return
            await asyncio.to_thread(_make)
            from covista_service.dashboard import serving

            async with serving.started():
                self._up.set_result(None)
                await self._over.wait()
        except Exception as error:
            log.exception("the pages cannot be served")
            if not self._up.done():
                self._up.set_exception(error)
        finally:
            # Who asks as the station ends does not wait for ever.
            self._up.cancel()


def _make() -> ASGIApp:
    """Takes the better part of a second, once a process."""
    with _making:
        if not _made:
            from covista_service.dashboard import serving

            _made.append(serving.application())
        return _made[0]


async def pages(scope: Scope, receive: Receive, send: Send) -> None:
    """What is below the prefix of the pages: who asks first waits until they are there."""
    loop = asyncio.get_running_loop()
    for opening in [each for each in _opening if each.loop is loop]:
        await opening.up()
    app = _made[0] if _made else await asyncio.to_thread(_make)
    await app(scope, receive, send)


def open_pages() -> int:
    """How many pages are open now."""
    if not _made:
        return 0
    from covista_service.dashboard import serving

    return serving.open_pages()


@asynccontextmanager
async def opened() -> AsyncIterator[None]:
    """Serve the pages meanwhile. Of several stations in one process, as tests have them, one does at a time."""
    if not has_pages() or not _turn.acquire(blocking=False):
        yield
        return
    opening = _Opening()
    _opening.append(opening)
    work = asyncio.create_task(opening.work())
    try:
        yield
    finally:
        opening.end()
        await work
        _opening.remove(opening)
        _turn.release()
        await asyncio.sleep(0)
