"""Who has a place in the house: as many robots as there is room for, and few that nobody could understand yet."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Container
from typing import Literal

# What was heard of a robot: something that nobody can read, a liveliness token, or a message.
Word = Literal["garbage", "token", "message"]
TOO_MANY_ROBOTS = "too_many_robots"
UNKNOWN_ROBOT = "unknown_robot"
# A robot silent for so long gives its place to another when the house is full.
IDLE_NS = 600 * 1_000_000_000
# Robots of which nothing but garbage came. A rover that is being written is one; a thousand names are an attack.
MAX_STRANGERS = 64


class Places:
    """Robots by when they were heard last.

    Strangers among them have sent nothing but garbage. Callers have sent no message either, but have a token: a token
    costs nothing, so that they give way to whoever sends a message.

    Whoever has no place and still has mail is parting. Callers may have to part at any time, so that both together are
    no more than there are places: never does the mail of more than twice as many robots wait.
    """

    def __init__(self, max_robots: int, max_strangers: int = MAX_STRANGERS) -> None:
        self._max_robots = max_robots
        self._max_strangers = max_strangers
        self._heard_ns: OrderedDict[str, int] = OrderedDict()
        self._strangers: OrderedDict[str, None] = OrderedDict()
        self._callers: OrderedDict[str, None] = OrderedDict()
        self._parting: set[str] = set()

    def __contains__(self, robot: str) -> bool:
        return robot in self._heard_ns

    def admit(self, robot: str, now_ns: int, word: Word, *, waiting: Container[str]) -> str | None:
        """Note what was heard of a robot; the reason why there is no place for it, None where there is.

        Robots with mail `waiting` do not lose their places, unless they are callers.
        """
        if robot not in self._heard_ns:
            reason = self._make_room(now_ns, waiting, word)
            if reason is not None:
                return reason
            if word == "token" and not self._may_part(robot):
                return TOO_MANY_ROBOTS
            self._parting.discard(robot)
            if word == "garbage":
                self._strangers[robot] = None
            elif word == "token":
                self._callers[robot] = None
        elif word == "message":
            self._callers.pop(robot, None)
            self._strangers.pop(robot, None)
        elif word == "token" and robot in self._strangers and self._may_part(robot):
            del self._strangers[robot]
            self._callers[robot] = None
        self._heard_ns[robot] = now_ns
        self._heard_ns.move_to_end(robot)
        return None

    def part(self, robot: str) -> bool:
        """Let mail wait of a robot that has no place; False if it must not."""
        if not self._may_part(robot):
            return False
        self._parting.add(robot)
        return True

    def parted(self, robot: str) -> None:
        """No mail of the robot waits any more."""
        self._parting.discard(robot)

    def _may_part(self, robot: str) -> bool:
        return robot in self._parting or len(self._parting) + len(self._callers) < self._max_robots

    def _make_room(self, now_ns: int, waiting: Container[str], word: Word) -> str | None:
        if word == "garbage" and len(self._strangers) >= self._max_strangers:
            return None if self._evict(next(iter(self._strangers)), now_ns, waiting) else UNKNOWN_ROBOT
        if len(self._heard_ns) < self._max_robots or self._evict(next(iter(self._heard_ns)), now_ns, waiting):
            return None
        if word != "message" or not self._callers:
            return TOO_MANY_ROBOTS
        caller = next(iter(self._callers))
        self._take_out(caller)
        if caller in waiting:
            self._parting.add(caller)
        return None

    def _evict(self, robot: str, now_ns: int, waiting: Container[str]) -> bool:
        """Take the place of a robot that has not been heard for long; False if it may keep it."""
        if robot in waiting or now_ns - self._heard_ns[robot] < IDLE_NS:
            return False
        self._take_out(robot)
        return True

    def _take_out(self, robot: str) -> None:
        del self._heard_ns[robot]
        self._strangers.pop(robot, None)
        self._callers.pop(robot, None)
