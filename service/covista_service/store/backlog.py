"""What waits to be written. It is bounded: the oldest goes first, counted, with the time that it was of."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from covista_service.store.rows import Entry, PairEntry, TrackEntry, time_us_of

Sampled = TrackEntry | PairEntry


@dataclass(frozen=True, slots=True)
class Loss:
    """Entries that are missing from the history, and the time that they were of."""

    since_us: int
    until_us: int
    lost: int

    def and_of(self, other: Loss) -> Loss:
        """Both as one."""
        return Loss(min(self.since_us, other.since_us), max(self.until_us, other.until_us), self.lost + other.lost)


class Backlog:
    """What was told goes before what was sampled, and is not pushed out by it. Not for several threads at once."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._told: deque[Entry] = deque()
        self._sampled: deque[Entry] = deque()
        self._loss: Loss | None = None
        self.lost = 0
        # Told entries that came, those that are written or lost, and those that are lost.
        self.told_came = self.told_went = self.told_lost = 0

    def __len__(self) -> int:
        return len(self._told) + len(self._sampled)

    def tell(self, entries: Sequence[Entry]) -> None:
        """What happened."""
        self._told.extend(entries)
        self.told_came += len(entries)
        self._fit()

    def sample(self, entries: Iterable[Entry]) -> None:
        """What was looked up."""
        self._sampled.extend(entries)
        self._fit()

    def take(self, limit: int) -> list[Entry]:
        """The next entries; whoever takes them says that they are `written`, `put_back`, or `lose`s them."""
        return [self._next() for _ in range(min(limit, len(self)))]

    def take_loss(self) -> Loss | None:
        """What is missing and not yet in the database as a gap; it is `put_back` where the gap cannot be written.

        What goes missing meanwhile is another gap's.
        """
        loss, self._loss = self._loss, None
        return loss

    def written(self, batch: Sequence[Entry]) -> None:
        """These are in the database."""
        self.told_went += _told_of(batch)

    def put_back(self, batch: Sequence[Entry], loss: Loss | None = None) -> None:
        """These could not be written; they are still the next ones, and what is missing is missing still."""
        if loss is not None:
            self._miss(loss)
        for entry in reversed(batch):
            (self._sampled if isinstance(entry, Sampled) else self._told).appendleft(entry)
        self._fit()

    def lose(self, entries: Iterable[Entry]) -> None:
        """These will never be written."""
        for entry in entries:
            time_us = time_us_of(entry)
            self._miss(Loss(time_us, time_us, 1))
            self.lost += 1
            told = not isinstance(entry, Sampled)
            self.told_went += told
            self.told_lost += told

    def _miss(self, loss: Loss) -> None:
        self._loss = loss if self._loss is None else self._loss.and_of(loss)

    def _next(self) -> Entry:
        return self._told.popleft() if self._told else self._sampled.popleft()

    def _fit(self) -> None:
        for waiting in (self._told, self._sampled):
            while len(waiting) > self._most:
                self.lose([waiting.popleft()])


def _told_of(batch: Sequence[Entry]) -> int:
    return sum(not isinstance(entry, Sampled) for entry in batch)
