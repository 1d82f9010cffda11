"""What a station says of all messages, when nobody sends any more."""

from __future__ import annotations

from dataclasses import dataclass

from covista_service.bench.soak_books import Sent
from covista_service.bench.soak_station import Samples


@dataclass(frozen=True, slots=True)
class Accounts:
    """What the station says of all messages when nobody sends any more, and what was sent."""

    received: int
    fates: int
    waiting: int
    missing: int
    duplicate: int
    sent: Sent

    @property
    def unaccounted(self) -> int:
        """Messages with no fate or with two, or beyond the bounds of what was sent."""
        heard = self.received + self.missing - self.duplicate - self.sent.garbage
        beyond = max(0, self.sent.least - heard, heard - self.sent.most)
        return abs(self.received - self.fates - self.waiting) + self.waiting + beyond


def accounts_of(samples: Samples, sent: Sent) -> Accounts:
    """What metrics say of all messages of both topics, forgotten robots' included."""

    def total(name: str, word: str = "") -> int:
        found = (value for key, value in samples.items() if key.startswith(f"{name}{{") and word in key)
        return round(sum(found))

    fates = sum(total("covista_messages_total", f"fate={fate},") for fate in ("used", "replaced", "duplicate"))
    return Accounts(
        received=total("covista_messages_total", "fate=received,"),
        fates=fates + total("covista_dropped_total"),
        waiting=total("covista_messages_waiting"),
        missing=total("covista_messages_missing"),
        duplicate=total("covista_messages_total", "fate=duplicate,"),
        sent=sent,
    )
