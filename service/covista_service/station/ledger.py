"""What became of every message of a robot, so that nothing is lost uncounted."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import Counter, OrderedDict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

MessageId = tuple[str, int]
# More gaps than this in one boot are counted but no longer told apart from what was heard.
MAX_INTERVALS = 1024
# Of older boots only the number of missing messages is kept.
MAX_BOOTS = 8
# What became of messages whose fate was open when their robot was forgotten.
FORGOTTEN = "forgotten"


@dataclass(frozen=True, slots=True)
class Run:
    """`count` messages of a boot with numbers in [first, end): all of these, or which ones is not known any more."""

    boot: str
    first: int
    end: int
    count: int


@dataclass(frozen=True, slots=True)
class Counts:
    """Messages of one robot and topic, all boots.

    sent = received + missing; received = used + replaced + duplicate + waiting + the sum of dropped (by reason).
    """

    received: int = 0
    used: int = 0
    replaced: int = 0
    duplicate: int = 0
    missing: int = 0
    waiting: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict)


@dataclass(slots=True, eq=False)
class Total:
    """Accounts of several ledgers as one."""

    fates: Counter[str] = field(default_factory=Counter)
    dropped: Counter[str] = field(default_factory=Counter)
    missing: int = 0
    waiting: int = 0

    def copy(self) -> Total:
        """The same, to go on from."""
        return Total(self.fates.copy(), self.dropped.copy(), self.missing, self.waiting)

    def counts(self) -> Counts:
        """As they are told."""
        return Counts(
            received=self.fates["received"],
            used=self.fates["used"],
            replaced=self.fates["replaced"],
            duplicate=self.fates["duplicate"],
            missing=self.missing,
            waiting=self.waiting,
            dropped=dict(self.dropped),
        )


class Sequences:
    """Which sequence numbers of a boot were heard, as merged intervals [start, end)."""

    def __init__(self) -> None:
        self._starts: list[int] = []
        self._ends: list[int] = []
        self._heard = 0

    @property
    def missing(self) -> int:
        """Numbers from 0 to the highest one that were not heard."""
        return self._ends[-1] - self._heard if self._ends else 0

    def __contains__(self, number: int) -> bool:
        at = bisect_right(self._starts, number) - 1
        return at >= 0 and number < self._ends[at]

    def add(self, number: int) -> bool:
        """Hear a number; False if it was heard before."""
        ends = self._ends
        if ends and number == ends[-1]:
            ends[-1] = number + 1
        elif number in self:
            return False
        else:
            self._insert(bisect_right(self._starts, number), number)
        self._heard += 1
        return True

    def add_run(self, first: int, end: int, count: int) -> int:
        """Hear `count` of the numbers in [first, end), and say how many of those were not heard before.

        Where they are not all of these, the others are no longer told apart from what was heard.
        """
        starts, ends = self._starts, self._ends
        left, right = bisect_left(ends, first), bisect_right(starts, end)
        known = sum(
            max(0, min(end, ended) - max(first, started))
            for started, ended in zip(starts[left:right], ends[left:right], strict=True)
        )
        fresh = min(count, end - first - known)
        if left < right:
            first, end = min(first, starts[left]), max(end, ends[right - 1])
        starts[left:right], ends[left:right] = [first], [end]
        self._heard += fresh
        self._bound()
        return fresh

    def _insert(self, at: int, number: int) -> None:
        joins_left = at > 0 and self._ends[at - 1] == number
        joins_right = at < len(self._starts) and self._starts[at] == number + 1
        if joins_left and joins_right:
            self._ends[at - 1] = self._ends.pop(at)
            del self._starts[at]
        elif joins_left:
            self._ends[at - 1] += 1
        elif joins_right:
            self._starts[at] -= 1
        else:
            self._starts.insert(at, number)
            self._ends.insert(at, number + 1)
            self._bound()

    def _bound(self) -> None:
        if len(self._starts) > MAX_INTERVALS:
            del self._starts[1], self._ends[0]


class Ledger:
    """The accounts of one robot and topic."""

    def __init__(self) -> None:
        self._boots: OrderedDict[str, Sequences] = OrderedDict()
        self._missing_before = 0
        self._counts: Counter[str] = Counter()
        self._dropped: Counter[str] = Counter()
        # Announced: received, its content still to come. Open: its content is here, its fate undecided.
        self._announced: dict[MessageId, None] = {}
        self._open: set[MessageId] = set()

    def hear(self, messages: Iterable[MessageId], kept: MessageId | None) -> None:
        """Enter arrivals in order; `kept` is to come with its content, what else is new was replaced."""
        # In locals: of a robot in a hurry, thousands of messages were replaced since the last time.
        received = duplicate = waiting = 0
        boot: str | None = None
        for message in messages:
            received += 1
            if message[0] != boot:
                boot = message[0]
                sequences = self._sequences(boot)
            if not sequences.add(message[1]):
                duplicate += 1
            elif message == kept:
                self._announced[message] = None
                waiting += 1
        self._counts["received"] += received
        self._counts["duplicate"] += duplicate
        self._counts["replaced"] += received - duplicate - waiting

    def take(self, message: MessageId) -> bool:
        """Open a message whose content is here; False if it was taken before and counts as a duplicate already."""
        if message[1] not in self._sequences(message[0]):
            self.hear((message,), message)
        if message not in self._announced:
            return False
        del self._announced[message]
        self._open.add(message)
        return True

    def settle(self, message: MessageId, fate: Literal["used", "replaced"]) -> None:
        """Decide what became of an open message."""
        self._open.remove(message)
        self._counts[fate] += 1

    def reject(self, message: MessageId, code: str) -> None:
        """An open message turned out to be of no use."""
        self._open.remove(message)
        self._dropped[code] += 1

    def drop(self, code: str, count: int, *, counted: bool) -> None:
        """Messages that could not be read; `counted` if they were heard before.

        Of those, one that was not announced has its fate already: it was a duplicate.
        """
        if not counted:
            self._counts["received"] += count
            self._dropped[code] += count
            return
        for message in list(self._announced)[:count]:
            del self._announced[message]
            self._dropped[code] += 1

    def give_up(self, code: str, runs: Iterable[Run]) -> None:
        """Messages of which no more than the name was read, and is heard now."""
        for run in runs:
            fresh = self._sequences(run.boot).add_run(run.first, run.end, run.count)
            self._counts["received"] += run.count
            self._counts["duplicate"] += run.count - fresh
            self._dropped[code] += fresh

    def close(self) -> None:
        """The robot is forgotten: nothing more can become of what waits."""
        if waiting := len(self._announced) + len(self._open):
            self._dropped[FORGOTTEN] += waiting
        self._announced.clear()
        self._open.clear()

    def add_to(self, total: Total) -> None:
        """Add these accounts to those of others."""
        for fate, count in self._counts.items():
            total.fates[fate] += count
        for code, count in self._dropped.items():
            total.dropped[code] += count
        total.missing += self._missing_before + sum(sequences.missing for sequences in self._boots.values())
        total.waiting += len(self._announced) + len(self._open)

    def counts(self) -> Counts:
        """The accounts now."""
        total = Total()
        self.add_to(total)
        return total.counts()

    def _sequences(self, boot: str) -> Sequences:
        if boot not in self._boots:
            self._boots[boot] = Sequences()
            if len(self._boots) > MAX_BOOTS:
                self._missing_before += self._boots.popitem(last=False)[1].missing
        return self._boots[boot]
