"""Websockets: how many, and what is listened to."""

import asyncio
from collections import deque
from typing import Any

from covista_service.dashboard.sockets import bounded_sockets

TEXT = {"type": "websocket.receive", "text": "2probe"}
BINARY = {"type": "websocket.receive", "bytes": b"x", "text": None}


class Pages:
    """What stands behind: hears until it is told that the socket is gone."""

    def __init__(self) -> None:
        self.heard: list[str] = []
        self.go_on = asyncio.Event()

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        while (message := await receive())["type"] != "websocket.disconnect":
            self.heard.append(message.get("text", message["type"]))
        await self.go_on.wait()


async def opened(app: Any, *said: dict[str, Any], kind: str = "websocket") -> list[dict[str, Any]]:
    turns, sent = deque(said), []

    async def receive() -> dict[str, Any]:
        return turns.popleft() if turns else {"type": "websocket.disconnect", "code": 1000}

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    await app({"type": kind}, receive, send)
    return sent


def test_so_many_sockets_are_open_and_no_more_until_one_goes() -> None:
    async def trying() -> None:
        pages = Pages()
        app = bounded_sockets(pages, most=2)
        first = [asyncio.create_task(opened(app)) for _ in range(2)]
        await asyncio.sleep(0)
        assert await opened(app) == [{"type": "websocket.close", "code": 1013}]
        pages.go_on.set()
        assert await asyncio.gather(*first) == [[], []]
        assert await opened(app) == []

    asyncio.run(trying())


def test_text_goes_through_and_binary_data_is_the_end() -> None:
    async def trying() -> None:
        pages = Pages()
        pages.go_on.set()
        sent = await opened(bounded_sockets(pages), TEXT, BINARY, TEXT)
        assert pages.heard == ["2probe"]
        assert sent == [{"type": "websocket.close", "code": 1008}]

    asyncio.run(trying())


def test_what_is_no_socket_is_none_of_its_business() -> None:
    async def trying() -> None:
        pages = Pages()
        pages.go_on.set()
        await opened(bounded_sockets(pages, most=0), {"type": "http.request"}, kind="http")
        assert pages.heard == ["http.request"]

    asyncio.run(trying())
