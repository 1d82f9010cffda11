"""How long REST takes to begin its answers, by route."""

from __future__ import annotations

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from covista_service.api.deps import State

# Where all nouns are; a route of FastAPI names it or not, as its version has it.
PREFIX = "/api/v1"
# What no route answers: there are as many such paths as anybody likes to ask for.
NO_ROUTE = "none"


def timed(app: ASGIApp) -> ASGIApp:
    """Times every request until its answer begins; what breaks is a 500."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await app(scope, receive, send)
            return
        state: State = scope["state"]
        telemetry = state["parts"].telemetry
        begun_s = telemetry.timer()
        telemetry.asked()
        answered = False

        def note(status: int) -> None:
            nonlocal answered
            if not answered:
                answered = True
                telemetry.answered(_route_of(scope), status, telemetry.timer() - begun_s)

        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                note(message["status"])
            await send(message)

        try:
            await app(scope, receive, sending)
        finally:
            note(500)

    return answer


def _route_of(scope: Scope) -> str:
    """The template of the path, without what all have in common: bounded in number, unlike paths."""
    return str(getattr(scope.get("route"), "path", NO_ROUTE)).removeprefix(PREFIX)
