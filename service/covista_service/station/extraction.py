"""Keyframes that come as images, on their way to features: one of each robot at a worker, the newest one next."""

from __future__ import annotations

from collections import Counter

from covista_service.station.events import Keyframe, KeyframeId


class Extractions:
    """Takes robots in turns, at most `capacity` under way; that may change.

    What is under way is finished and used even if a newer keyframe waits: a robot that sends faster than workers
    extract would otherwise never be seen at all.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._waiting: dict[str, Keyframe] = {}
        self._under_way: dict[str, Keyframe] = {}
        # Keyframes whose robots are forgotten: workers have their hands full of them all the same.
        self._abandoned: Counter[KeyframeId] = Counter()

    def wait(self, keyframe: Keyframe) -> Keyframe | None:
        """Let a keyframe wait in its robot's place; the older one whose place it takes."""
        older = self._waiting.get(keyframe.id.robot)
        self._waiting[keyframe.id.robot] = keyframe
        return older

    def withdraw(self, robot: str) -> Keyframe | None:
        """Take away a robot's waiting keyframe, if it has one."""
        return self._waiting.pop(robot, None)

    def forget(self, robot: str) -> None:
        """Drop a robot's keyframes; what is under way is so until it is done, and what comes of it does not matter."""
        self._waiting.pop(robot, None)
        keyframe = self._under_way.pop(robot, None)
        if keyframe is not None:
            self._abandoned[keyframe.id] += 1

    def start(self) -> list[Keyframe]:
        """Keyframes to extract now, under way from now on."""
        started: list[Keyframe] = []
        for robot in [robot for robot in self._waiting if robot not in self._under_way]:
            if len(self._under_way) + self._abandoned.total() >= self.capacity:
                break
            self._under_way[robot] = self._waiting.pop(robot)
            started.append(self._under_way[robot])
        return started

    def done(self, keyframe: KeyframeId) -> Keyframe | None:
        """An extraction is over; its keyframe, None if it was not under way."""
        held = self._under_way.get(keyframe.robot)
        if held is None or held.id != keyframe:
            self._abandoned -= Counter([keyframe])
            return None
        return self._under_way.pop(keyframe.robot)
