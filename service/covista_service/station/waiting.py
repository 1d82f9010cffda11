"""Pairs that wait for their next survey, the one with the most to tell for its age first."""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heapify, heappop, heappush

from covista_service.perception.camera import Pose
from covista_service.station.events import Pair

# What is expected of a pair that was never surveyed, and the most that counts.
UNSEEN = 3.0
MOST = 4.0
# Entries that stand for nothing any longer are cleared away when they are so many times the others.
_STALE = 2
_FEW = 64


@dataclass(slots=True, eq=False)
class Plan:
    """A pair on the agenda: its turn at its last survey, and the two poses that were surveyed then.

    `due` is its next turn while it waits.
    """

    turn: float
    poses: tuple[Pose, Pose] | None = None
    due: float | None = None


class Waiting:
    """A queue by virtual time, in which a pair's next turn comes 1 / (1 + news) after its last.

    The turn of the queue is that of the latest pair served. So pairs with equal news take turns, one with news n gets
    1 + n times as many as one with none, and who waits is overtaken by each other pair at most 1 + MOST times.
    """

    def __init__(self) -> None:
        self._plans: dict[Pair, Plan] = {}
        self._queue: list[tuple[float, Pair]] = []
        self.turn = 0.0

    def __len__(self) -> int:
        return len(self._plans)

    def __contains__(self, pair: object) -> bool:
        return pair in self._plans

    def put(self, pair: Pair, plan: Plan, news: float) -> None:
        """Let a pair wait; one that waits already comes sooner if there is more news, and never later."""
        due = plan.turn + 1 / (1 + min(max(news, 0.0), MOST))
        if plan.due is not None and due >= plan.due:
            return
        plan.due = due
        self._plans[pair] = plan
        heappush(self._queue, (due, pair))
        if len(self._queue) > _STALE * len(self._plans) + _FEW:
            self._queue = [(each.due, name) for name, each in self._plans.items() if each.due is not None]
            heapify(self._queue)

    def take(self) -> Pair | None:
        """The pair whose turn it is; it waits no longer."""
        while self._queue:
            due, pair = heappop(self._queue)
            plan = self._plans.get(pair)
            if plan is not None and plan.due == due:
                self.drop(pair)
                self.turn = max(self.turn, due)
                return pair
        return None

    def served(self, pair: Pair, plan: Plan, poses: tuple[Pose, Pose]) -> None:
        """A pair is surveyed now, at these poses, whoever gave it its turn."""
        self.drop(pair)
        plan.turn, plan.poses = self.turn, poses

    def drop(self, pair: Pair) -> None:
        """A pair waits no longer."""
        plan = self._plans.pop(pair, None)
        if plan is not None:
            plan.due = None
