"""How far the views of a swarm reach: a bound for those whose own depth is not known yet."""

from __future__ import annotations

import math

import numpy as np

# So many robots must have told how far they may see.
_ENOUGH = 8
# It is told anew after news of one robot in so many.
_SHARE = 4


class Horizon:
    """Infinite until enough is known, then what is usual in the swarm: the median of how far views may reach.

    That is three times the depth of what has been seen, so there is room in it. Who sees farther than that without
    anybody's having told its depth is found by the sweep.
    """

    def __init__(self) -> None:
        self._far_m: dict[str, float] = {}
        self._news = 0
        self.farthest_m = math.inf

    def note(self, robot: str, far_m: float) -> bool:
        """A robot's view reaches so far; True if there is a bound from now on."""
        self._far_m[robot] = far_m
        self._news += 1
        if len(self._far_m) < _ENOUGH or (math.isfinite(self.farthest_m) and self._news * _SHARE < len(self._far_m)):
            return False
        before, self._news = self.farthest_m, 0
        self.farthest_m = float(np.median(list(self._far_m.values())))
        return math.isinf(before)

    def forget(self, robot: str) -> None:
        """Drop a robot."""
        self._far_m.pop(robot, None)
