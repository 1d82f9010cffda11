"""Bodies of requests before any route hears of them, message by message as a server hands them on."""

import asyncio
from typing import Any

import pytest
from covista_service.api import bodies
from covista_service.api.bodies import MAX_BYTES, bounded

CHUNKED = [(b"transfer-encoding", b"chunked")]
Message = dict[str, Any]


def part(body: bytes, more: bool = True) -> Message:
    return {"type": "http.request", "body": body, "more_body": more}


class Exchange:
    """One request, and what became of it."""

    def __init__(self, headers: list[tuple[bytes, bytes]], *messages: Message) -> None:
        self.scope = {"type": "http", "path": "/x", "headers": headers}
        self.messages = list(messages)
        self.heard: list[Message] = []
        self.sent: list[Message] = []
        self.called = False

    async def _receive(self) -> Message:
        if not self.messages:
            await asyncio.Event().wait()
        return self.messages.pop(0)

    async def _send(self, message: Any) -> None:
        self.sent.append(message)

    async def _app(self, _scope: Any, receive: Any, _send: Any) -> None:
        self.called = True
        while not self.heard or self.heard[-1]["type"] != "http.disconnect":
            self.heard.append(await receive())

    def run(self) -> "Exchange":
        asyncio.run(bounded(self._app)(self.scope, self._receive, self._send))
        return self

    @property
    def status(self) -> int:
        return int(self.sent[0]["status"])


GONE = {"type": "http.disconnect"}


def test_a_body_comes_whole_and_what_comes_after_it_too() -> None:
    exchange = Exchange(CHUNKED, part(b"ab"), part(b""), part(b"c", more=False), GONE).run()
    assert exchange.heard == [part(b"abc", more=False), GONE]


def test_without_a_body_nothing_is_waited_for() -> None:
    for headers in ([], [(b"content-length", b"0")]):
        exchange = Exchange(headers, part(b"", more=False), GONE).run()
        assert exchange.heard == [part(b"", more=False), GONE]


def test_what_is_announced_as_too_long_is_not_read() -> None:
    exchange = Exchange([(b"content-length", str(MAX_BYTES + 1).encode())], part(b"x")).run()
    assert exchange.status == 413
    assert exchange.messages
    assert not exchange.called


def test_what_turns_out_too_long_is_read_no_further() -> None:
    parts = [part(MAX_BYTES // 2 * b"x") for _ in range(10)]
    exchange = Exchange(CHUNKED, *parts).run()
    assert exchange.status == 413
    assert len(exchange.messages) == 7
    assert not exchange.called


def test_a_length_that_was_a_lie_is_not_believed() -> None:
    exchange = Exchange([(b"content-length", b"5")], part((MAX_BYTES + 1) * b"x", more=False)).run()
    assert exchange.status == 413


def test_what_does_not_come_is_waited_for_no_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bodies, "TIMEOUT_S", 0.01)
    exchange = Exchange([(b"content-length", b"5")], part(b"x")).run()
    assert exchange.status == 408
    assert not exchange.called


def test_who_leaves_is_answered_nothing() -> None:
    exchange = Exchange([(b"content-length", b"5")], part(b"x"), GONE).run()
    assert not exchange.sent
    assert not exchange.called
