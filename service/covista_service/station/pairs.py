"""What is known about every pair of robots, how it was found and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from covista_schemas.reports import FoundBy

from covista_service.perception.survey import Outcome, Survey
from covista_service.station.events import Keyframe, KeyframeId, Pair

NOT_SURVEYED = "not_surveyed"
FAILED = "failed"
# Images that were compared, and did not match, speak against what poses and depths predict.
_UNMATCHED = (Outcome.FEW_MATCHES, Outcome.UNVERIFIED)


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The overlap of a pair as last found, on which keyframes: `overlaps` are the shares of first's and second's."""

    overlaps: tuple[float, float]
    found_by: FoundBy
    computed_ns: int
    first: Keyframe
    second: Keyframe


@dataclass(frozen=True, slots=True, eq=False)
class PairRecord:
    """One pair: the answer in force, the last survey, what it came to, and the keyframes it was made on."""

    answer: Answer | None = None
    survey: Survey | None = None
    outcome: str = NOT_SURVEYED
    surveyed: tuple[KeyframeId, KeyframeId] | None = None

    @property
    def measured(self) -> bool:
        """Does the answer rest on images?"""
        return self.answer is not None and self.answer.found_by is FoundBy.IMAGE

    @property
    def unmatched(self) -> bool:
        """Were the images compared, and did not match?"""
        return self.outcome in _UNMATCHED


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

    def surveyed(self, first: Keyframe, second: Keyframe, survey: Survey | None, now_ns: int) -> None:
        """Enter a survey, None if it failed. One that measured nothing takes the former answer's place too."""
        pair = (first.id.robot, second.id.robot)
        ids = (first.id, second.id)
        outcome = FAILED if survey is None else str(survey.outcome)
        self._records[pair] = PairRecord(None, survey, outcome, ids)
        self._by_age.pop(pair, None)
        if survey is None or survey.outcome is not Outcome.MEASURED:
            return
        if survey.overlap_first is not None and survey.overlap_second is not None:
            overlaps = (survey.overlap_first, survey.overlap_second)
            self._answer(pair, Answer(overlaps, FoundBy.IMAGE, now_ns, first, second))

    def predicted(self, first: Keyframe, second: Keyframe, overlaps: tuple[float, float], now_ns: int) -> None:
        """Enter an overlap computed from poses and depths."""
        pair = (first.id.robot, second.id.robot)
        self._answer(pair, Answer(overlaps, FoundBy.PREDICTED, now_ns, first, second))

    def expire(self, now_ns: int) -> list[Pair]:
        """Drop the answers that have become too old to stand for anything; the pairs that are unknown now."""
        expired: list[Pair] = []
        for pair, computed_ns in self._by_age.items():
            if now_ns - computed_ns < self._unknown_after_ns:
                break
            expired.append(pair)
        for pair in expired:
            del self._by_age[pair]
            self._records[pair] = replace(self._records[pair], answer=None, survey=None)
        return expired

    def forget(self, robot: str) -> None:
        """Drop every pair of a robot."""
        for pair in [pair for pair in self._records if robot in pair]:
            del self._records[pair]
            self._by_age.pop(pair, None)

    def records(self) -> Mapping[Pair, PairRecord]:
        """All records now, as a copy."""
        return dict(self._records)

    def _answer(self, pair: Pair, answer: Answer) -> None:
        self._records[pair] = replace(self[pair], answer=answer)
        self._by_age.pop(pair, None)
        self._by_age[pair] = answer.computed_ns
