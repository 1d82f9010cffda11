"""What happens to the rovers of a soak, drawn by chance before any of it does: the same for the same seed."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

# Between two things that happen, on average.
EVERY_S = 6.0
LEAST_PAUSE_S, MOST_PAUSE_S = 2.0, 15.0
Act = Literal["leave", "kill", "reboot", "pause", "garbage"]
GENTLE: tuple[Act, ...] = ("leave", "pause", "garbage")
ROUGH: tuple[Act, ...] = (*GENTLE, "kill", "reboot")
# Of three robots one is never killed, so that what it has sent is known to the message.
_SPARED_OF = 3


@dataclass(frozen=True, slots=True)
class Turn:
    """So long after the turn before, this is done to a robot, or it joins if it is not there; a pause is so long."""

    gap_s: float
    robot: int
    act: Act
    pause_s: float


def spared(robot: int) -> bool:
    """Is it one that is never killed?"""
    return robot % _SPARED_OF == 0


def turns(chance: random.Random, robots: int) -> Iterator[Turn]:
    """One after the other, without end."""
    while True:
        gap_s, robot = chance.expovariate(1 / EVERY_S), chance.randrange(robots)
        act = chance.choice(GENTLE if spared(robot) else ROUGH)
        yield Turn(gap_s, robot, act, chance.uniform(LEAST_PAUSE_S, MOST_PAUSE_S))


def roster(chance: random.Random, robots: int) -> list[int]:
    """Who is there at first: as many as there will be in the long run, or the first minutes would look like a trend.

    Who is not there joins at its turn; who is leaves for good at one of three, or goes by two of five.
    """
    there = [1 / (1 + _gone(GENTLE if spared(robot) else ROUGH)) for robot in range(robots)]
    return [robot for robot in range(robots) if chance.random() < there[robot]]


def _gone(acts: tuple[Act, ...]) -> float:
    """At how many of its turns a robot goes and does not come back at once."""
    return sum(act in ("leave", "kill") for act in acts) / len(acts)
