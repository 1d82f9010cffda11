"""The loop's source of events: mail, opened when the loop asks for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from covista_service.link.mailbox import Mailboxes
from covista_service.link.translate import events_of
from covista_service.station.events import Event


class Inbox:
    """Mailboxes as a `loop.Source`."""

    def __init__(self, mailboxes: Mailboxes) -> None:
        self._mailboxes = mailboxes

    def attach(self, wake: Callable[[], None]) -> None:
        """Say whom to wake, from any thread, when there is mail."""
        self._mailboxes.attach(wake)

    def drain(self, limit: int) -> tuple[Iterator[Event], bool]:
        """Events of up to `limit` robots, and whether there are more."""
        mail, more = self._mailboxes.drain(limit)
        return (event for each in mail for event in events_of(each)), more
