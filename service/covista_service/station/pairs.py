"""What is known about every pair of robots, how it was found and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from covista_schemas.reports import FoundBy

from covista_service.perception.camera import Pose
from covista_service.perception.certainty import Interval
from covista_service.perception.comparison import Comparison, Outcome
from covista_service.perception.visibility import SAME_SCALE
from covista_service.station.ages import Ages
from covista_service.station.events import Keyframe, KeyframeId, Pair
from covista_service.station.outlook import Outlook, Ratios

NOT_SURVEYED = "not_surveyed"
FAILED = "failed"


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The overlap of a pair as last found, on which keyframes: `overlaps` are the shares of first's and second's.

    `intervals` hold the true shares in nine cases of ten. `outlooks` are those of the keyframes, None if their views
    cannot meet, and `ratios` those that the scales of their depths may have. `poses` are those that it stands for, and
    `times_ns` their sensor times; `sources` are the keyframes whose surfaces it rests on. Where it does not say, those
    are the keyframes' own, and themselves. `matched`: the images of the sources share matched points.
    """

    overlaps: tuple[float, float]
    found_by: FoundBy
    computed_ns: int
    first: Keyframe
    second: Keyframe
    intervals: tuple[Interval, Interval] | None = None
    outlooks: tuple[Outlook, Outlook] | None = None
    ratios: Ratios = SAME_SCALE
    poses: tuple[Pose, Pose] | None = None
    times_ns: tuple[int, int] | None = None
    sources: tuple[KeyframeId, KeyframeId] | None = None
    matched: bool = False

    @property
    def remembered(self) -> bool:
        """Is it of a time before this station started, by a keyframe of which no features are left?"""
        return self.first.features is None or self.second.features is None

    @property
    def keyframes(self) -> tuple[KeyframeId, KeyframeId]:
        """Which keyframes it is of."""
        return self.first.id, self.second.id

    @property
    def stands_for_ns(self) -> tuple[int, int]:
        """Sensor times of the poses that it stands for."""
        return self.times_ns or (self.first.time_ns, self.second.time_ns)

    def stands_for(self, first: Pose, second: Pose) -> bool:
        """Is it of these very poses?"""
        return self.poses is not None and self.poses[0] is first and self.poses[1] is second

    @property
    def rests_on(self) -> tuple[KeyframeId, KeyframeId]:
        """The keyframes whose surfaces it was read from."""
        return self.sources or self.keyframes


@dataclass(frozen=True, slots=True, eq=False)
class PairRecord:
    """One pair: the answer in force, the last survey, what it came to, and the keyframes it was made on.

    `expired` is an answer that has grown too old: read again from the same surfaces it does not come back. `verified`:
    the last survey that did not fail has found something in common.
    """

    answer: Answer | None = None
    compared: Comparison | None = None
    outcome: str = NOT_SURVEYED
    surveyed: tuple[KeyframeId, KeyframeId] | None = None
    expired: Answer | None = None
    verified: bool = False

    @property
    def measured(self) -> bool:
        """Does the answer rest on images?"""
        return self.answer is not None and self.answer.matched

    @property
    def remembered(self) -> bool:
        """Is the answer one of the station before? Perhaps it rests on images."""
        return self.answer is not None and self.answer.remembered

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
    """Records of the pairs whose views may meet, and when their answers grow too old.

    All others share nothing, and are so many that nothing is kept of them: see `apart`.
    """

    def __init__(self, unknown_after_ns: int) -> None:
        self._unknown_after_ns = unknown_after_ns
        self._records: dict[Pair, PairRecord] = {}
        self._beside: dict[str, dict[str, None]] = {}
        self._ages = Ages()
        self._copy: Mapping[Pair, PairRecord] | None = None

    def __getitem__(self, pair: Pair) -> PairRecord:
        return self._records.get(pair, _NOTHING)

    def __len__(self) -> int:
        return len(self._records)

    def __contains__(self, pair: object) -> bool:
        return pair in self._records

    def beside(self, robot: str) -> list[str]:
        """Robots that there is a record with."""
        return list(self._beside.get(robot, ()))

    def overlaps(self, pair: Pair) -> tuple[float, float] | None:
        """Overlaps in force, the smaller id's first; None where unknown."""
        answer = self[pair].answer
        return None if answer is None else answer.overlaps

    def meet(self, pair: Pair, answer: Answer | None) -> None:
        """Keep a record of a pair from now on; `answer` is what stands for it until then."""
        if pair not in self._records:
            self._put(pair, PairRecord())
            if answer is not None:
                self.enter(pair, answer)

    def part(self, pair: Pair) -> PairRecord:
        """Keep no record of a pair any longer; the one that was kept."""
        record = self._records.pop(pair, None)
        if record is None:
            return _NOTHING
        self._copy = None
        if record.answer is not None:
            self._ages.drop(pair, record.answer.computed_ns)
        for robot, other in (pair, pair[::-1]):
            del self._beside[robot][other]
            if not self._beside[robot]:
                del self._beside[robot]
        return record

    def surveyed(self, first: Keyframe, second: Keyframe, compared: Comparison | None) -> None:
        """Enter what a survey came to, None if it failed; the answer stands until surfaces are built with it."""
        pair = (first.id.robot, second.id.robot)
        record, surveyed = self[pair], (first.id, second.id)
        outcome = FAILED if compared is None else str(compared.outcome)
        verified = record.verified if compared is None else outcome == Outcome.MEASURED
        record = replace(record, compared=compared, outcome=outcome, surveyed=surveyed, verified=verified)
        self._put(pair, record)

    def enter(self, pair: Pair, answer: Answer) -> bool:
        """Enter the overlap as read from what is known now; True if the last one was read from the same surfaces.

        Read anew from the surfaces of the same keyframes, for newer poses too, an answer may be better, but it is no
        younger.
        """
        record = self[pair]
        held = record.answer
        again = held is not None and held.rests_on == answer.rests_on
        if record.expired is not None and _same(record.expired, answer):
            return again
        if held is not None and _same(held, answer):
            if answer.computed_ns != held.computed_ns:
                answer = replace(answer, computed_ns=held.computed_ns)
            # Written out: several thousand times a second, `replace` can be felt.
            self._records[pair] = PairRecord(
                answer, record.compared, record.outcome, record.surveyed, record.expired, record.verified
            )
            self._copy = None
            return again
        self._put(pair, replace(record, answer=answer, expired=None))
        if held is not None:
            self._ages.drop(pair, held.computed_ns)
        self._ages.put(pair, answer.computed_ns)
        return again

    def expire(self, now_ns: int) -> list[Pair]:
        """Drop the answers that have become too old to stand for anything; the pairs that are unknown now."""
        expired = self._ages.take(now_ns - self._unknown_after_ns)
        for pair in expired:
            record = self._records[pair]
            old = None if record.answer is None else replace(record.answer, outlooks=None)
            self._put(pair, replace(record, answer=None, compared=None, expired=old))
        return expired

    def forget(self, robot: str) -> None:
        """Drop every pair of a robot."""
        for other in self.beside(robot):
            self.part(pair_of(robot, other))

    def records(self) -> Mapping[Pair, PairRecord]:
        """All records now, as a copy."""
        if self._copy is None:
            self._copy = dict(self._records)
        return self._copy

    def _put(self, pair: Pair, record: PairRecord) -> None:
        self._records[pair] = record
        self._copy = None
        for robot, other in (pair, pair[::-1]):
            self._beside.setdefault(robot, {})[other] = None


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """The keyframe by which it was judged whom a robot's view may meet, and when that was done first."""

    keyframe: Keyframe
    first_ns: int


def apart(first: Judged, second: Judged) -> Answer:
    """The answer about two robots, the smaller id first, whose views cannot meet: they share nothing.

    It is as old as the younger of the two judgements.
    """
    computed_ns = max(first.first_ns, second.first_ns)
    answer = Answer((0.0, 0.0), FoundBy.PREDICTED, computed_ns, first.keyframe, second.keyframe)
    return replace(answer, found_by=FoundBy.DECAYED) if answer.remembered else answer


def _same(held: Answer, answer: Answer) -> bool:
    """Do two answers rest on the surfaces of the same keyframes in the same way?"""
    return (held.rests_on, held.matched) == (answer.rests_on, answer.matched)
