"""Names of messages that a mailbox had no place for: runs of numbers instead of a name each.

So the station hears each of them, and its accounts stay exact, though millions come between two turns.
"""

from __future__ import annotations

from dataclasses import dataclass

from covista_service.station.ledger import MessageId, Run

# Runs of all boots; from then on the last one of a boot takes in what comes, gaps and all.
MAX_RUNS = 1024


@dataclass(slots=True, eq=False)
class _Open:
    """A run that may grow still, numbers [first, end)."""

    first: int
    end: int
    count: int


class Surplus:
    """The messages of one robot and topic that were given up since the last drain."""

    __slots__ = ("_last", "_runs")

    def __init__(self) -> None:
        self._runs: list[tuple[str, _Open]] = []
        self._last: dict[str, _Open] = {}

    def __bool__(self) -> bool:
        return bool(self._runs)

    @property
    def count(self) -> int:
        """How many messages."""
        return sum(run.count for _, run in self._runs)

    def runs(self) -> tuple[Run, ...]:
        """Their names."""
        return tuple(Run(boot, run.first, run.end, run.count) for boot, run in self._runs)

    def add(self, name: MessageId) -> bool:
        """Note a message; False where its boot is one too many."""
        boot, number = name
        run = self._last.get(boot)
        if run is not None and run.end == number:
            run.end += 1
            run.count += 1
        elif len(self._runs) < MAX_RUNS:
            run = self._last[boot] = _Open(number, number + 1, 1)
            self._runs.append((boot, run))
        elif run is not None:
            run.first, run.end = min(run.first, number), max(run.end, number + 1)
            run.count += 1
        else:
            return False
        return True
