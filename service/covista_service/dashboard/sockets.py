"""What pages say over their websockets is next to nothing, and so is what the station listens to and keeps of it."""

from __future__ import annotations

from starlette.types import ASGIApp, Message, Receive, Scope, Send

# Sockets that are open at a time: one a page, and some that were cut off and are not known to be gone.
MOST_SOCKETS = 512
_NOT_ALLOWED, _TRY_LATER = 1008, 1013


def bounded_sockets(app: ASGIApp, most: int = MOST_SOCKETS) -> ASGIApp:
    """Opens no more than `most`, and ends one that sends binary data, which would be kept: no page does."""
    open_now = 0

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        nonlocal open_now
        if scope["type"] != "websocket":
            await app(scope, receive, send)
            return
        if open_now >= most:
            await send({"type": "websocket.close", "code": _TRY_LATER})
            return
        open_now += 1
        try:
            await app(scope, _text_alone(receive, send), send)
        finally:
            open_now -= 1

    return answer


def _text_alone(receive: Receive, send: Send) -> Receive:
    async def receiving() -> Message:
        message = await receive()
        if message["type"] == "websocket.receive" and message.get("bytes") is not None:
            await send({"type": "websocket.close", "code": _NOT_ALLOWED})
            return {"type": "websocket.disconnect", "code": _NOT_ALLOWED}
        return message

    return receiving
