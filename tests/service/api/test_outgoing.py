import asyncio
import threading
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass, field

import pytest
from covista_service.api.outgoing import CHUNK_BYTES, Body, Outgoing, body_of
from hypothesis import given
from hypothesis import strategies as st


@given(st.lists(st.integers(0, 3 * CHUNK_BYTES), max_size=6))
def test_a_body_is_its_pieces_in_chunks_of_bounded_length(sizes: list[int]) -> None:
    pieces = [bytes([i]) * size for i, size in enumerate(sizes)]
    body = body_of(pieces)
    assert b"".join(body.chunks) == b"".join(pieces)
    assert body.size == sum(sizes)
    assert all(0 < len(chunk) < 2 * CHUNK_BYTES for chunk in body.chunks)
    assert len(body.chunks) <= body.size // CHUNK_BYTES + 1


@dataclass
class Press:
    """Makes answers of whatever version is current, when it is let."""

    outgoing: Outgoing = field(default_factory=Outgoing)
    version: int = 0
    made: list[int] = field(default_factory=list)
    let: threading.Event = field(default_factory=threading.Event)
    size: int = 10
    kind: str = "matrix"

    def order(self) -> Awaitable[Body]:
        return self.outgoing.share(self.kind, lambda: f"v{self.version}", self._make)

    def _make(self) -> Callable[[], Iterable[bytes]]:
        version = self.version

        def pieces() -> Iterable[bytes]:
            assert self.let.wait(10)
            self.made.append(version)
            return [bytes(self.size)]

        return pieces


async def turn(times: int = 5) -> None:
    for _ in range(times):
        await asyncio.sleep(0)


def test_who_asks_while_an_answer_is_made_gets_the_next_and_they_share_it() -> None:
    async def scenario() -> None:
        press = Press()
        first = asyncio.ensure_future(press.order())
        await turn()
        press.version = 1
        second = asyncio.ensure_future(press.order())
        await turn()
        press.version = 2
        others = [asyncio.ensure_future(press.order()) for _ in range(50)]
        await turn()
        press.let.set()
        bodies = await asyncio.gather(first, second, *others)
        assert press.made == [0, 2]
        assert [body.tag for body in bodies] == ["v0"] + 51 * ["v2"]
        assert len(set(map(id, bodies))) == 2

    asyncio.run(scenario())


def test_what_is_current_is_made_once_and_what_is_not_is_made_anew() -> None:
    async def scenario() -> None:
        press = Press()
        press.let.set()
        assert await press.order() is await press.order()
        press.version = 1
        assert (await press.order()).tag == "v1"
        assert press.made == [0, 1]

    asyncio.run(scenario())


def test_of_two_kinds_each_has_its_own_and_of_many_few_are_kept() -> None:
    async def scenario() -> None:
        press = Press()
        press.let.set()
        bodies = {}
        for kind in ("a", "b"):
            press.kind = kind
            bodies[kind] = await press.order()
            assert await press.order() is bodies[kind]
        assert bodies["a"] is not bodies["b"]
        for number in range(10):
            press.kind = f"c{number}"
            await press.order()
        press.kind = "a"
        assert await press.order() is not bodies["a"]
        assert len(press.outgoing._newest) <= 2

    asyncio.run(scenario())


def test_what_has_no_version_is_shared_by_those_who_wait_and_by_nobody_else() -> None:
    async def scenario() -> None:
        press, outgoing = Press(), Outgoing()

        def order() -> Awaitable[Body]:
            return outgoing.share("pairs", str, press._make)

        first = asyncio.ensure_future(order())
        await turn()
        others = [asyncio.ensure_future(order()) for _ in range(10)]
        await turn()
        press.let.set()
        bodies = await asyncio.gather(first, *others)
        assert len(set(map(id, bodies))) == 2
        assert await order() not in bodies
        assert press.made == [0, 0, 0]

    asyncio.run(scenario())


def test_a_failure_is_the_one_s_who_asked_and_the_next_is_tried_again() -> None:
    async def scenario() -> None:
        press = Press()
        press.let.set()

        def broken() -> Callable[[], Iterable[bytes]]:
            raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            await press.outgoing.share("matrix", lambda: "v0", broken)
        assert (await press.order()).tag == "v0"

    asyncio.run(scenario())


def test_where_too_much_is_under_way_the_newest_is_sent_again() -> None:
    async def scenario() -> None:
        press = Press(Outgoing(most_bytes=35))
        press.let.set()
        held = []
        for version in range(8):
            press.version = version
            held.append(await press.order())
            assert press.outgoing.take(held[-1])
            assert press.outgoing.held_bytes <= 35
        assert press.made == [0, 1, 2]
        for body in held:
            press.outgoing.give_back(body)
        assert press.outgoing.held_bytes == 0
        assert (await press.order()).tag == "v7"

    asyncio.run(scenario())


def test_a_body_of_one_client_alone_is_refused_where_too_much_is_under_way() -> None:
    outgoing = Outgoing(most_bytes=100)
    large, other = Body((bytes(90),)), Body((bytes(90),))
    assert outgoing.take(large)
    assert outgoing.take(large)
    assert not outgoing.take(other)
    outgoing.give_back(large)
    assert not outgoing.take(other)
    outgoing.give_back(large)
    assert outgoing.take(other)


def test_a_body_larger_than_all_may_be_is_sent_when_nothing_else_is() -> None:
    assert Outgoing(most_bytes=1).take(Body((bytes(90),)))
