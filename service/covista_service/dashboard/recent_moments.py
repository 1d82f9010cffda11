"""Moments of the past that somebody has just asked for: who scrubs comes to the same ones again.

What all pairs had in common at a moment takes seconds to find where there are hundreds of robots.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeVar

from covista_service.answers.past import Archive, Moment
from covista_service.loop.rooms import Room
from covista_service.station.options import NS_PER_S

# Large swarms have many pairs.
_KEPT = 8
# Of what is younger the last rows may not have been written yet.
_SETTLED_NS = 10 * NS_PER_S
_T = TypeVar("_T")


@dataclass(slots=True, eq=False)
class RecentMoments:
    """The last moments by the second, found one at a time so that readers are left for everybody else."""

    _room: Room = field(default_factory=lambda: Room(at_once=1, waiting=20))
    _kept: OrderedDict[int, Moment] = field(default_factory=OrderedDict)

    async def run(self, work: Callable[[], _T]) -> _T:
        """Do it in a thread in which `at` may be asked. Raises FullError."""
        return await self._room.run(work)

    def at(self, archive: Archive, time_ns: int, reach_s: float, now_ns: int) -> Moment:
        """The swarm then; places and overlaps as the second began, but groups exactly."""
        if time_ns > now_ns - _SETTLED_NS:
            return archive.moment(time_ns, reach_s)
        second = time_ns // NS_PER_S
        found = self._kept.pop(second, None)
        if found is None:
            found = archive.moment(second * NS_PER_S, reach_s)
        self._kept[second] = found
        while len(self._kept) > _KEPT:
            self._kept.popitem(last=False)
        return replace(found, groups=archive.groups_at(time_ns))
