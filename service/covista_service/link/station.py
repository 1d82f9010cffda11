"""The station's end of zenoh: who is let in, what robots say, and how it is doing."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import zenoh
from covista_schemas.reports import PartHealth

from covista_service.link import zenoh_log
from covista_service.link.admission import Lock
from covista_service.link.ingest import Ingest
from covista_service.link.mailbox import Mailboxes
from covista_service.link.switchboard import Part, Switchboard, opening


@dataclass(frozen=True, slots=True)
class LinkOptions:
    """End points to listen on and to join, the site, and who is let in; without a lock everybody is."""

    listen: Sequence[str]
    connect: Sequence[str]
    site: str
    lock: Lock | None = None


class StationLink:
    """Opens the session. Raises LinkError where that cannot be."""

    def __init__(self, options: LinkOptions) -> None:
        self._options = options
        self._ingest: Ingest | None = None
        open_for = opening(options.listen, options.connect, options.site, options.lock)
        self.switchboard = Switchboard(open_for, options.lock, alive=self._alive)

    def plug_ingest(self, mailboxes: Mailboxes) -> Part:
        """Hear robots, in this session and in those that come after it; returns how to end that."""

        def join(session: zenoh.Session) -> Part:
            self._ingest = Ingest(session, self._options.site, mailboxes)
            return self._ingest.part

        return self.switchboard.plug(join)

    @property
    def refused(self) -> dict[str, int]:
        """How many were not let in, by reason."""
        return {**zenoh_log.refused, **self.switchboard.strangers.refused}

    def health(self) -> PartHealth:
        """Whether robots can reach us, and those that should."""
        options = self._options
        places = ", ".join(each.split("#")[0] for each in (*options.listen, *options.connect))
        problem = self.switchboard.problem
        if problem is None and not options.listen and not self.switchboard.joined:
            problem = "no router answers"
        if problem is not None:
            return PartHealth(status="degraded", detail=f"{places}; {problem}")
        return PartHealth(status="ready", detail=places)

    def _alive(self) -> Collection[str] | None:
        return None if self._ingest is None else self._ingest.alive
