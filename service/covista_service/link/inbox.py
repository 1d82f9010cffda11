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

    def drain(self, limit: int, now_ns: int) -> tuple[Iterator[Event], int | None]:
        """Events of up to `limit` robots, and when there are more; None: not before somebody is woken."""
        mail, next_ns = self._mailboxes.drain(limit, now_ns)
        return (event for each in mail for event in events_of(each)), next_ns
