"""What a method is asked, and what it answers."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from covista_service.perception.camera import View
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


@dataclass(frozen=True, slots=True, eq=False)
class TimedSurvey:
    """The survey of a pair, and the time that it took."""

    survey: Survey
    ms: float


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One question to the methods: the views of a set, the pairs to compare, and the surveys of those pairs.

    A set without cameras has neither views nor surveys.
    """

    pairs: tuple[Pair, ...]
    views: tuple[View, ...] | None
    surveys: Mapping[Pair, TimedSurvey]


def surveyed(
    pairs: Sequence[Pair],
    views: tuple[View, ...] | None,
    options: SurveyOptions,
    advance: Callable[[], None] = lambda: None,
) -> Case:
    """Survey every pair, once for all methods; `advance` is called after each."""
    if views is None:
        return Case(tuple(pairs), None, {})
    for first, second in pairs[:1]:
        survey(views[first], views[second], options)  # so that what is compiled on first use is not timed
    surveys: dict[Pair, TimedSurvey] = {}
    for first, second in pairs:
        start = time.perf_counter_ns()
        found = survey(views[first], views[second], options)
        surveys[first, second] = TimedSurvey(found, (time.perf_counter_ns() - start) / 1e6)
        advance()
    return Case(tuple(pairs), views, surveys)
