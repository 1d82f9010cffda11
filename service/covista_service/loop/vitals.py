"""What the parts around the station tell of themselves, for Prometheus."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from covista_service.loop.parties import CrewStatus, SinkStatus


class Mail(Protocol):
    """What waits in the mailboxes: robots with mail, messages, and bytes of payload."""

    @property
    def robots(self) -> int:
        """Robots with mail."""

    @property
    def messages(self) -> int:
        """Messages whose names wait; of each robot and topic the content of one."""

    @property
    def payload_bytes(self) -> int:
        """Content that waits."""


@dataclass(frozen=True, slots=True)
class Vitals:
    """The parts now.

    `turned_away` counts messages on no robot's account, by reason; `sinks` are by name; `sessions` are zenoh's that the
    link has with rovers, routers and listeners; `link_refused` counts who was not let in there, by reason.
    """

    mail: Mail
    crew: CrewStatus
    sinks: Mapping[str, SinkStatus]
    turned_away: Mapping[str, int]
    sessions: int
    link_refused: Mapping[str, int] = field(default_factory=dict)
