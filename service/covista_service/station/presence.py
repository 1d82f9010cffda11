"""Whose presence is another than it was: those who were heard of at once, everybody some times a second."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from covista_schemas.reports import Status

from covista_service.station.options import NS_PER_S
from covista_service.station.roster import Robot, Roster

_LOOK_NS = NS_PER_S // 10


class Presence:
    """Looks at robots so often as is needed, for a look at everybody costs what there are robots."""

    def __init__(self, roster: Roster) -> None:
        self._roster = roster
        # Who was heard of since presence was looked at, and when everybody's was.
        self._heard: dict[str, None] = {}
        self._looked_ns: int | None = None

    def heard(self, robot: str) -> None:
        """There was a sign of life."""
        self._heard[robot] = None

    def changes(self, everybody: Sequence[str], now_ns: int) -> Iterator[tuple[Robot, Status | None]]:
        """Robots whose presence has changed and what it is now: None for who has been silent for too long."""
        heard, self._heard = self._heard, {}
        due = self._looked_ns is None or not 0 <= now_ns - self._looked_ns < _LOOK_NS
        if due:
            self._looked_ns = now_ns
        for name in list(everybody) if due else sorted(heard):
            robot = self._roster.get(name)
            if robot is None:
                continue
            status = None if self._roster.lapsed(robot, now_ns) else self._roster.status(robot, now_ns)
            if status is None or status is not robot.status:
                yield robot, status
