"""Puts the pages into the station's application, and starts and ends what serves them."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import APIRouter, FastAPI, Request, Response
from fastapi.responses import RedirectResponse

from covista_service.answers import NotKnownError
from covista_service.dashboard.places import PREFIX, has_pages

_ABSENT = "this station was installed without its pages: pip install 'covista[dashboard]'"
# NiceGUI has one application a process, in one event loop.
_turn = threading.Lock()


def add_pages(app: FastAPI) -> None:
    """Add them below `PREFIX`, or where NiceGUI is not installed a word about that."""
    routes = APIRouter(prefix=PREFIX, include_in_schema=False)
    if not has_pages():

        @routes.get("")
        @routes.get("/{_path:path}")
        async def absent() -> None:
            raise NotKnownError("No dashboard", _ABSENT)

        app.include_router(routes)
        return
    from covista_service.dashboard import data, data_health, data_past, data_robot, data_settings, log_in, serving

    @routes.get("")
    async def first(request: Request) -> Response:
        return RedirectResponse(f"{request.scope.get('root_path', '')}{PREFIX}/")

    routes.include_router(data.router)
    routes.include_router(data_health.router)
    routes.include_router(data_past.router)
    routes.include_router(data_robot.router)
    routes.include_router(data_settings.router)
    routes.include_router(log_in.router)
    app.include_router(routes)
    app.mount(PREFIX, serving.application())


@asynccontextmanager
async def opened() -> AsyncIterator[None]:
    """Serve the pages meanwhile. Of several stations in one process, as tests have them, one does at a time."""
    if not has_pages():
        yield
        return
    from covista_service.dashboard import serving

    if not _turn.acquire(blocking=False):
        yield
        return
    try:
        async with serving.started():
            yield
    finally:
        _turn.release()
        await asyncio.sleep(0)
