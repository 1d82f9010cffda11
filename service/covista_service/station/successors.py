"""Keyframes that wait until the one before them has a surface: of each robot the newest."""

from __future__ import annotations

from collections.abc import Callable

from covista_service.station.events import Keyframe
from covista_service.station.options import NS_PER_S

# A worker that does not come back must not hold up a robot.
_LONGEST_NS = 2 * NS_PER_S


class Successors:
    """What a robot has sent while its keyframe in use is surveyed for the first time.

    That one is finished even if newer ones wait: a robot that sends faster than surveys are done would otherwise have
    each keyframe replaced before anything is known of it, and never be seen at all.
    """

    def __init__(self) -> None:
        self._waiting: dict[str, Keyframe] = {}
        # Since when there has been one, whichever: a newer one that takes the place does not begin anew.
        self._since_ns: dict[str, int] = {}

    def __getitem__(self, robot: str) -> Keyframe | None:
        return self._waiting.get(robot)

    def wait(self, keyframe: Keyframe) -> Keyframe | None:
        """Let a keyframe wait in its robot's place; the older one whose place it takes."""
        robot = keyframe.id.robot
        older = self._waiting.get(robot)
        self._waiting[robot] = keyframe
        self._since_ns.setdefault(robot, keyframe.arrived_ns)
        return older

    def withdraw(self, robot: str) -> Keyframe | None:
        """Take away a robot's waiting keyframe, if it has one."""
        self._since_ns.pop(robot, None)
        return self._waiting.pop(robot, None)

    def due(self, busy: Callable[[str], bool], now_ns: int) -> list[Keyframe]:
        """Keyframes of robots that are not `busy` any more, or have waited for long; they wait no longer."""
        due = [
            keyframe
            for robot, keyframe in self._waiting.items()
            if not 0 <= now_ns - self._since_ns[robot] < _LONGEST_NS or not busy(robot)
        ]
        for keyframe in due:
            self.withdraw(keyframe.id.robot)
        return due
