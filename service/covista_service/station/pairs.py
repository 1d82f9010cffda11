"""What is known about every pair of robots, how it was found and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from covista_schemas.reports import FoundBy

from covista_service.perception.certainty import Interval
from covista_service.perception.comparison import Comparison
from covista_service.perception.visibility import SAME_SCALE
from covista_service.station.events import Keyframe, KeyframeId, Pair
from covista_service.station.outlooks import Outlook, Ratios

NOT_SURVEYED = "not_surveyed"
FAILED = "failed"


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The overlap of a pair as last found, on which keyframes: `overlaps` are the shares of first's and second's.

    `intervals` hold the true shares in nine cases of ten. `outlooks` are what it was read from, None if their views
    cannot meet, and `ratios` those that the scales of their depths may have.
    """

    overlaps: tuple[float, float]
    found_by: FoundBy
    computed_ns: int
    first: Keyframe
    second: Keyframe
    intervals: tuple[Interval, Interval] | None = None
    outlooks: tuple[Outlook, Outlook] | None = None
    ratios: Ratios = SAME_SCALE

    @property
    def keyframes(self) -> tuple[KeyframeId, KeyframeId]:
        """Which keyframes it is of."""
        return self.first.id, self.second.id


@dataclass(frozen=True, slots=True, eq=False)
class PairRecord:
    """One pair: the answer in force, the last survey, what it came to, and the keyframes it was made on.

    `expired` is an answer that has grown too old: read again from the same keyframes it does not come back.
    """

    answer: Answer | None = None
    compared: Comparison | None = None
    outcome: str = NOT_SURVEYED
    surveyed: tuple[KeyframeId, KeyframeId] | None = None
    expired: Answer | None = None

    @property
    def measured(self) -> bool:
        """Does the answer rest on images?"""
        return self.answer is not None and self.answer.found_by is FoundBy.IMAGE

    @property
    def explained(self) -> bool:
        """Was the last survey, and with it the planes that it can tell, of the answer's keyframes?"""
        answer = self.answer
        return answer is not None and self.surveyed == answer.keyframes


_NOTHING = PairRecord()


def pair_of(a: str, b: str) -> Pair:
    """The unordered pair of two robots: the smaller id first."""
    return (a, b) if a < b else (b, a)


class Pairs:
    """Records by pair, and the order in which their answers grow too old."""

    def __init__(self, unknown_after_ns: int) -> None:
        self._unknown_after_ns = unknown_after_ns
        self._records: dict[Pair, PairRecord] = {}
        # Pairs with an answer, the oldest first: answers come in order of time.
        self._by_age: dict[Pair, int] = {}

    def __getitem__(self, pair: Pair) -> PairRecord:
        return self._records.get(pair, _NOTHING)

    def overlaps(self, pair: Pair) -> tuple[float, float] | None:
        """Overlaps in force, the smaller id's first; None where unknown."""
        answer = self[pair].answer
        return None if answer is None else answer.overlaps

    def surveyed(self, first: Keyframe, second: Keyframe, compared: Comparison | None) -> None:
        """Enter what a survey came to, None if it failed; the answer stands until surfaces are built with it."""
        pair = (first.id.robot, second.id.robot)
        outcome = FAILED if compared is None else str(compared.outcome)
        self._records[pair] = replace(self[pair], compared=compared, outcome=outcome, surveyed=(first.id, second.id))

    def enter(self, pair: Pair, answer: Answer) -> bool:
        """Enter the overlap as read from what is known now; True if the last one was read from the same keyframes.

        Read anew from the same keyframes an answer may be better, but it is no younger.
        """
        record = self[pair]
        again = record.answer is not None and record.answer.keyframes == answer.keyframes
        if record.expired is not None and _same(record.expired, answer):
            return again
        if record.answer is not None and _same(record.answer, answer):
            self._records[pair] = replace(record, answer=replace(answer, computed_ns=record.answer.computed_ns))
            return again
        self._records[pair] = replace(record, answer=answer, expired=None)
        self._by_age.pop(pair, None)
        self._by_age[pair] = answer.computed_ns
        return again

    def expire(self, now_ns: int) -> list[Pair]:
        """Drop the answers that have become too old to stand for anything; the pairs that are unknown now."""
        expired: list[Pair] = []
        for pair, computed_ns in self._by_age.items():
            if now_ns - computed_ns < self._unknown_after_ns:
                break
            expired.append(pair)
        for pair in expired:
            del self._by_age[pair]
            record = self._records[pair]
            old = None if record.answer is None else replace(record.answer, outlooks=None)
            self._records[pair] = replace(record, answer=None, compared=None, expired=old)
        return expired

    def forget(self, robot: str) -> None:
        """Drop every pair of a robot."""
        for pair in [pair for pair in self._records if robot in pair]:
            del self._records[pair]
            self._by_age.pop(pair, None)

    def records(self) -> Mapping[Pair, PairRecord]:
        """All records now, as a copy."""
        return dict(self._records)

    def __len__(self) -> int:
        return len(self._records)


def _same(held: Answer, answer: Answer) -> bool:
    """Do two answers rest on the same keyframes in the same way?"""
    return (held.keyframes, held.found_by) == (answer.keyframes, answer.found_by)
