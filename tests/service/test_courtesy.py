import asyncio
from collections.abc import Awaitable

from covista_service.loop.courtesy import MOST_S, give_way

Steps = list[str]


async def _with_other(giving: Awaitable[None], rounds: int) -> Steps:
    """What happens in which order while somebody else needs so many rounds of asyncio's loop."""
    steps: Steps = []

    async def other() -> None:
        for _ in range(rounds):
            await asyncio.sleep(0)
        steps.append("answered")

    answer = asyncio.create_task(other())
    await giving
    steps.append("next turn")
    await answer
    return steps


def test_an_answer_that_takes_many_rounds_is_there_before_the_next_turn() -> None:
    assert asyncio.run(_with_other(give_way(10.0, lambda: True), 20)) == ["answered", "next turn"]


def test_while_nobody_asks_no_turn_waits() -> None:
    assert asyncio.run(_with_other(give_way(10.0, lambda: False), 20)) == ["next turn", "answered"]


def test_who_asks_during_the_turn_is_seen() -> None:
    """What came over a socket is read after the turn, and is under way a round later."""
    asked = []

    async def scenario() -> Steps:
        loop = asyncio.get_running_loop()
        loop.call_soon(lambda: loop.call_soon(asked.append, "request"))
        return await _with_other(give_way(10.0, lambda: bool(asked)), 20)

    assert asyncio.run(scenario()) == ["answered", "next turn"]


def test_a_long_turn_gives_no_more_than_a_moment() -> None:
    async def timed_s() -> float:
        loop = asyncio.get_running_loop()
        begun_s = loop.time()
        async with asyncio.timeout(5.0):
            await give_way(3600.0, lambda: True)
        return loop.time() - begun_s

    assert asyncio.run(timed_s()) >= MOST_S / 2
