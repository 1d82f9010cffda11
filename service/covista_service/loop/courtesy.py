"""How the loop gives way to whoever waits for an answer: both have one thread to live in."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

# Of the time that a turn took, so much again belongs to the others.
SHARE = 1.0
MOST_S = 0.02
# What has come over a socket is a request that waits after so many rounds of asyncio's loop.
_ROUNDS = 3


async def give_way(turn_s: float, asked: Callable[[], bool]) -> None:
    """Let others have their turn after one that took `turn_s`: a moment, and longer while somebody is `asked` for.

    An answer takes several rounds of asyncio's loop. Were there a turn between any two, it would take as many turns.
    """
    for _ in range(_ROUNDS):
        await asyncio.sleep(0)
    if asked():
        await asyncio.sleep(min(SHARE * turn_s, MOST_S))
