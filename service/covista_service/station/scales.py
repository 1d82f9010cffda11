"""Which robots' depths have one scale, and how well each scale is known; asked of the neighbourhood, never of all."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from covista_service.perception.adjustment import AdjustmentOptions
from covista_service.perception.scales import ratio_range, scale_sigmas
from covista_service.perception.visibility import SAME_SCALE, VisibilityOptions
from covista_service.station.outlook import Outlook, Ratios

# Farther than the nearest so many by way of matches, a robot's scale is as good as its own.
NEAREST = 64
# A robot alone has seen others before, or moved itself: the scale of its depths is not just any.
_MOST_SCALE = 0.15


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """Robots whose depths have one scale, and the factor exp(+-`sigma`) that it is known to."""

    robots: frozenset[str]
    sigma: float


class Scales:
    """The scale of every robot's depths: one for all that are connected by matches, if by way of others.

    What is connected is explored robot by robot, the nearest first, and kept until one of them sees something new.
    """

    def __init__(self) -> None:
        self._outlooks: dict[str, Outlook] = {}
        # By robot: whose keyframes its own shares points with, and who says so of it.
        self._joins: dict[str, dict[str, None]] = {}
        self._joined: dict[str, dict[str, None]] = {}
        self._parts: dict[str, _Part] = {}
        # In whose parts a robot is.
        self._within: dict[str, set[str]] = {}

    def put(self, outlook: Outlook) -> None:
        """Take a robot's outlook in the place of the one before."""
        robot = outlook.keyframe.id.robot
        joins = dict.fromkeys(name.robot for name in outlook.matched if name.robot != robot)
        changed = self._joins.get(robot, {}).keys() ^ joins.keys()
        if robot not in self._outlooks:
            changed |= self._joined.get(robot, {}).keys()
        self._forget(robot, *changed)
        self._disjoin(robot)
        self._outlooks[robot], self._joins[robot] = outlook, joins
        for other in joins:
            self._joined.setdefault(other, {})[robot] = None

    def drop(self, robot: str) -> None:
        """Forget a robot."""
        self._forget(robot)
        self._disjoin(robot)
        self._outlooks.pop(robot, None)

    def ratios(self, one: str, other: str) -> Ratios:
        """Least and greatest ratio of the scales of two robots that have outlooks."""
        mine, its = self._part(one), self._part(other)
        if other in mine.robots or one in its.robots:
            return SAME_SCALE
        return ratio_range(mine.sigma, its.sigma, VisibilityOptions().scale_sigmas)

    def _part(self, robot: str) -> _Part:
        held = self._parts.get(robot)
        if held is None:
            robots = self._around(robot)
            held = self._parts[robot] = _Part(frozenset(robots), self._sigma(robots))
            for one in robots:
                self._within.setdefault(one, set()).add(robot)
        return held

    def _around(self, robot: str) -> list[str]:
        """The nearest robots by way of matches, itself first."""
        found, ahead = {robot: None}, deque([robot])
        while ahead:
            one = ahead.popleft()
            for other in (*self._joins.get(one, ()), *self._joined.get(one, ())):
                if other not in found and other in self._outlooks:
                    if len(found) == NEAREST:
                        return list(found)
                    found[other] = None
                    ahead.append(other)
        return list(found)

    def _sigma(self, robots: list[str]) -> float:
        outlooks = [self._outlooks[robot] for robot in robots]
        centres = np.array([outlook.pose.centre_m for outlook in outlooks])
        depths = np.array([outlook.depths_m[1] for outlook in outlooks])
        same = np.zeros(len(robots), np.int64)
        return min(float(scale_sigmas(centres, depths, same, AdjustmentOptions().position_share)[0]), _MOST_SCALE)

    def _forget(self, *robots: str) -> None:
        """Robots have changed: explore anew who is connected with them."""
        for robot in robots:
            for one in self._within.pop(robot, ()):
                part = self._parts.pop(one, None)
                for other in () if part is None else part.robots:
                    self._within.get(other, set()).discard(one)

    def _disjoin(self, robot: str) -> None:
        for other in self._joins.pop(robot, ()):
            beside = self._joined[other]
            beside.pop(robot)
            if not beside:
                del self._joined[other]
