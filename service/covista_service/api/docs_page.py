"""The page on which people read and try the description. All of it comes from the station, far from any net."""

from __future__ import annotations

from pathlib import Path

import fastapi_offline
from fastapi import FastAPI, Response
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import RedirectResponse
from fastapi.staticfiles import StaticFiles

DOCS = "/docs"
FILES = f"{DOCS}/files"
FILE_NAMES = ("swagger-ui-bundle.js", "swagger-ui.css", "favicon.png")
# A package that has Swagger UI in it, as it is published.
_FOLDER = Path(fastapi_offline.__file__).parent / "static"


def serve_docs(app: FastAPI, first: str = DOCS) -> None:
    """Show the app's description at `DOCS`, and lead from the root to what is to be seen `first`."""
    script, style, icon = (f"{FILES}/{name}" for name in FILE_NAMES)
    app.mount(FILES, StaticFiles(directory=_FOLDER))

    @app.get(DOCS, include_in_schema=False)
    async def page() -> Response:
        return get_swagger_ui_html(
            openapi_url=str(app.openapi_url),
            title=app.title,
            swagger_js_url=script,
            swagger_css_url=style,
            swagger_favicon_url=icon,
        )

    @app.get("/", include_in_schema=False)
    async def root() -> Response:
        return RedirectResponse(first)
