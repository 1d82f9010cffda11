"""Puts the pages into the station's application."""

from __future__ import annotations

from fastapi import APIRouter, FastAPI, Request, Response
from fastapi.responses import RedirectResponse

from covista_service.answers import NotKnownError
from covista_service.dashboard.places import PREFIX, has_pages

_ABSENT = "this station was installed without its pages: pip install 'covista[dashboard]'"


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
    from covista_service.dashboard import data, data_health, data_past, data_robot, data_settings, log_in, opening

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
    app.mount(PREFIX, opening.pages)
