"""What a method is asked, and what it answers."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from covista_service.perception.camera import View
from covista_service.perception.comparators.image import Image
from covista_service.perception.survey import Survey, SurveyOptions, survey

Pair = tuple[int, int]
FoundBy = Literal["image", "predicted", "unknown"]


@dataclass(frozen=True, slots=True)
class Answer:
    """What a method says of a pair (a, b): shares of either image that the other sees, or None.

    `outcome` names what it came to, whether there is an answer or not; `ms` is the time that this pair cost.
    """

    found_by: FoundBy
    outcome: str
    overlap_a: float | None = None
    overlap_b: float | None = None
    interval_a: tuple[float, float] | None = None
    interval_b: tuple[float, float] | None = None
    inliers: int = 0
    planes: int = 0
    ms: float = 0.0


NO_CAMERA = Answer("unknown", "no_camera")
NO_DEPTH = Answer("unknown", "no_depth")


@dataclass(frozen=True, slots=True, eq=False)
class TimedSurvey:
    """The survey of a pair, and the time that it took."""

    survey: Survey
    ms: float


class Surveys(Mapping[Pair, TimedSurvey]):
    """The surveys of all pairs of a set, each made when it is first asked for; `advance` is called after each.

    Methods share them, and none is made that no method uses. Without `views` there are none.
    """

    def __init__(
        self,
        pairs: Sequence[Pair],
        views: Sequence[View] | None,
        options: SurveyOptions,
        advance: Callable[[], None] = lambda: None,
    ) -> None:
        self._pairs = dict.fromkeys(pairs if views else ())
        self._views = views or ()
        self._options = options
        self._advance = advance
        self._made: dict[Pair, TimedSurvey] = {}

    @property
    def left(self) -> int:
        """How many nobody has asked for yet."""
        return len(self._pairs) - len(self._made)

    def __getitem__(self, pair: Pair) -> TimedSurvey:
        if pair not in self._made:
            if pair not in self._pairs:
                raise KeyError(pair)
            start = time.perf_counter_ns()
            found = survey(self._views[pair[0]], self._views[pair[1]], self._options)
            self._made[pair] = TimedSurvey(found, (time.perf_counter_ns() - start) / 1e6)
            self._advance()
        return self._made[pair]

    def __iter__(self) -> Iterator[Pair]:
        return iter(self._pairs)

    def __len__(self) -> int:
        return len(self._pairs)


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One question to the methods: the views of a set, the pairs to compare, and the surveys of those pairs.

    A set without cameras has neither views nor surveys; its images are all that is known of it.
    """

    pairs: tuple[Pair, ...]
    views: tuple[View, ...] | None
    surveys: Mapping[Pair, TimedSurvey]
    images: tuple[Image, ...] = ()


def connected(pairs: Sequence[Pair]) -> list[set[int]]:
    """Sets of images that the pairs to compare connect."""
    parts: list[set[int]] = []
    for pair in pairs:
        touched = [part for part in parts if not part.isdisjoint(pair)]
        parts = [part for part in parts if part.isdisjoint(pair)]
        parts.append(set(pair).union(*touched))
    return parts
