"""Answers that are asked for all the time, as text that is made once while what it tells of stands."""

from __future__ import annotations

import asyncio

from covista_service.answers.grouping import groups_report
from covista_service.answers.robots import robot_view_report
from covista_service.station.snapshot import GroupsView, RobotView, Snapshot

# Robots that are put into words before everybody else has a turn.
_AT_ONCE = 32


class Texts:
    """`robots_report` and `groups_report` as JSON; for the thread of the event loop alone.

    Most robots have not changed since somebody asked last, for each has its turn: only those that have are put into
    words anew.
    """

    def __init__(self) -> None:
        self._robots: dict[str, tuple[RobotView, bytes]] = {}
        self._groups: tuple[GroupsView, bytes] | None = None

    async def robots(self, snapshot: Snapshot) -> bytes:
        """All robots as they are in the snapshot."""
        texts: list[bytes] = []
        made = 0
        for name, view in snapshot.robots.items():
            held = self._robots.get(name)
            if held is None or held[0] is not view:
                held = self._robots[name] = view, robot_view_report(view).model_dump_json().encode()
                made += 1
                if made % _AT_ONCE == 0:
                    await asyncio.sleep(0)
            texts.append(held[1])
        if len(self._robots) > 2 * len(snapshot.robots):
            self._robots = {name: held for name, held in self._robots.items() if name in snapshot.robots}
        return b'{"robots":[%b],"next":null}' % b",".join(texts)

    def groups(self, snapshot: Snapshot) -> bytes:
        """The groups in force."""
        view = snapshot.groups
        # Groups that were never in force are of now.
        if self._groups is None or self._groups[0] is not view or not view.time_ns:
            self._groups = view, groups_report(snapshot).model_dump_json().encode()
        return self._groups[1]
