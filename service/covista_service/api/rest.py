"""The REST interface as one application: all routers, errors and the description."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version

from fastapi import APIRouter, FastAPI, Response
from fastapi.responses import JSONResponse
from starlette.middleware.cors import CORSMiddleware
from starlette.types import ASGIApp, Lifespan, Receive, Scope, Send

from covista_service.access import Door, Pages
from covista_service.api import contract, errors, events, groups, health, pairs, robots, settings, similarity
from covista_service.api.bodies import bounded
from covista_service.api.deps import PartsNow
from covista_service.api.docs_page import DOCS, serve_docs
from covista_service.api.guard import guarded
from covista_service.api.listening import HEAD_ONLY
from covista_service.api.timing import PREFIX, timed

_METHODS = ("GET", "HEAD", "POST", "PATCH", "DELETE")
_ASKED_WITH = ("authorization", "content-type", "if-none-match", "last-event-id")
_TOLD = ("etag", "link", "retry-after", "www-authenticate")


def build(
    lifespan: Lifespan[FastAPI] | None = None,
    cors_origins: Sequence[str] = (),
    pages: Pages | None = None,
    first: str = DOCS,
) -> FastAPI:
    """The application; its state, `deps.State`, is what `lifespan` yields. Pages of `cors_origins` may ask it.

    The door is kept for `pages` too, which somebody else adds; the root leads to what is to be seen `first`.
    """
    app = FastAPI(
        title="Covista",
        version=version("covista"),
        description="What robots see in common, and which of them belong together.",
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
    )
    nouns = APIRouter(prefix=PREFIX, responses=errors.describe(422, 500))
    for noun in (robots, pairs, similarity, groups, events, settings):
        nouns.include_router(noun.router)
    app.include_router(nouns)
    app.include_router(health.router)
    errors.install(app, lambda path: contract.methods_of(app.openapi(), path))
    # The last one added is the first to hear of a request.
    app.add_middleware(bounded)
    app.add_middleware(guarded(pages))
    if cors_origins:
        # Outside of the guard: browsers ask first, without a token, and pages are to read why they stay out.
        app.add_middleware(
            CORSMiddleware,
            allow_origins=list(cors_origins),
            allow_methods=_METHODS,
            allow_headers=_ASKED_WITH,
            expose_headers=_TOLD,
        )
    app.add_middleware(timed)
    app.add_middleware(_head_as_get)
    # FastAPI's way to replace its own description is to assign the method.
    setattr(app, "openapi", contract.describe(app))  # noqa: B010 - mypy refuses the plain assignment
    _serve_description(app)
    serve_docs(app, first)
    return app


def _serve_description(app: FastAPI) -> None:
    """In the place of the framework's own, which cannot say whether this station asks for tokens."""
    app.router.routes[:] = [route for route in app.router.routes if getattr(route, "path", "") != app.openapi_url]

    @app.get(str(app.openapi_url), include_in_schema=False)
    async def description(parts: PartsNow) -> Response:
        told = app.openapi()
        return JSONResponse(contract.without_tokens(told) if parts.gate.keyring.door is Door.OPEN else told)


def _head_as_get(app: ASGIApp) -> ASGIApp:
    """HEAD wherever GET is (RFC 9110); the server, which knows what was asked, leaves the content out."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        asked_for_head = scope["type"] == "http" and scope["method"] == "HEAD"
        await app({**scope, "method": "GET", HEAD_ONLY: True} if asked_for_head else scope, receive, send)

    return answer
