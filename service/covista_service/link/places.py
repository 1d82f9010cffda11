"""Who has a place in the house: as many robots as there is room for, and few that nobody could understand yet."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Container

TOO_MANY_ROBOTS = "too_many_robots"
UNKNOWN_ROBOT = "unknown_robot"
# A robot silent for so long gives its place to another when the house is full.
IDLE_NS = 600 * 1_000_000_000
# Robots of which nothing but garbage came. A rover that is being written is one; a thousand names are an attack.
MAX_STRANGERS = 64


class Places:
    """Robots by when they were heard last, and those among them that are strangers still."""

    def __init__(self, max_robots: int, max_strangers: int = MAX_STRANGERS) -> None:
        self._max_robots = max_robots
        self._max_strangers = max_strangers
        self._heard_ns: OrderedDict[str, int] = OrderedDict()
        self._strangers: OrderedDict[str, None] = OrderedDict()

    def admit(self, robot: str, now_ns: int, *, readable: bool, waiting: Container[str]) -> str | None:
        """Note a message, `readable` or not; the reason why there is no place for its robot, None where there is.

        Robots with mail `waiting` do not lose their places.
        """
        if robot not in self._heard_ns:
            reason = self._make_room(now_ns, waiting, stranger=not readable)
            if reason is not None:
                return reason
            if not readable:
                self._strangers[robot] = None
        elif readable and self._strangers:
            self._strangers.pop(robot, None)
        self._heard_ns[robot] = now_ns
        self._heard_ns.move_to_end(robot)
        return None

    def _make_room(self, now_ns: int, waiting: Container[str], *, stranger: bool) -> str | None:
        if stranger and len(self._strangers) >= self._max_strangers:
            return None if self._evict(next(iter(self._strangers)), now_ns, waiting) else UNKNOWN_ROBOT
        if len(self._heard_ns) >= self._max_robots:
            return None if self._evict(next(iter(self._heard_ns)), now_ns, waiting) else TOO_MANY_ROBOTS
        return None

    def _evict(self, robot: str, now_ns: int, waiting: Container[str]) -> bool:
        """Take the place of a robot that has not been heard for long; False if it may keep it."""
        if robot in waiting or now_ns - self._heard_ns[robot] < IDLE_NS:
            return False
        del self._heard_ns[robot]
        self._strangers.pop(robot, None)
        return True
