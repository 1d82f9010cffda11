"""How many groups, and which? The number at which a grouping scores best, by one of several criteria."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.grouping import merging, moves, scores
from covista_service.grouping.bounds import Bounds, Groups, with_least_size
from covista_service.grouping.k_means import Labels, canonical, dense
from covista_service.grouping.scores import Contributions, outsider
from covista_service.grouping.similarity import Floats
from covista_service.grouping.spectral import Spectrum, partition

Criterion = Literal["adaptive", "silhouette", "gain", "fiedler", "paper", "eigengap", "modularity"]
_Found = dict[int, tuple[float, Labels]]
# A pair inside a group must be worth this share of what its robots find with their best companions: by the criterion
# gain, and where adaptive begins (finer) and merges.
GAIN = 0.6
FINE = 0.9
MERGE = 0.7
# Up to so many robots adaptive scores every number of groups; above, those from one to the number of fine groups.
ONE_BY_ONE_UP_TO = 300
# Eq. 17 is not meant for larger swarms.
PAPER_UP_TO = 30
# For so many robots every number of groups is looked at; for more some that grow in proportion, and those about the
# best of them.
_ALL_UP_TO: Mapping[Criterion, int] = {"fiedler": 100, "paper": 100}
_ALL_ELSE = 40
_SPREAD = 1.25
# Scores closer than this, or than this share of the best, are a tie.
_TIE = 1e-9
# Down from the number that gain finds, scores of so many are told.
_TOLD_SHARE = 0.5
# Rows and columns that are checked together.
_BLOCK = 16


@dataclass(frozen=True, slots=True)
class SelectionOptions:
    """Bounds on number and size of groups (`bounds.Bounds`), and how the number is chosen.

    `stranger` is the similarity to an outsider that silhouette and gain hold groups against: `scores.outsider(alpha)`.

    - adaptive: fine groups by local moves, merged step by step to where the mean silhouette is best.
    - silhouette: Ng-Jordan-Weiss, at the number with the best mean silhouette.
    - gain: local moves to where no robot and no two groups gain by moving; the number comes out by itself.
    - fiedler: Eq. 17, the mean Fiedler value of the groups, with one group admitted.
    - paper: Eq. 17 as printed, two groups at least. Not meant for more than 30 robots.
    - eigengap: where the eigenvalues of D^-1/2 S D^-1/2 fall most.
    - modularity: Newman's, over the groups of Ng-Jordan-Weiss.
    """

    groups: Groups = "auto"
    criterion: Criterion = "adaptive"
    min_group_size: int = 1
    stranger: float = outsider(0.5)

    def __post_init__(self) -> None:
        """Raise ValueError for what is no such option."""
        if self.criterion not in get_args(Criterion):
            raise ValueError(f"criteria are {', '.join(get_args(Criterion))}, not {self.criterion!r}")
        # NaN is in no order with anything.
        if not 0 <= self.stranger <= 1:
            raise ValueError(f"an outsider's similarity lies from 0 to 1, not {self.stranger}")
        Bounds(self.groups, self.min_group_size)

    @property
    def bounds(self) -> Bounds:
        """Bounds on number and size."""
        return Bounds(self.groups, self.min_group_size)


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """Labels (N,) of the chosen grouping, and (number of groups, score) of every number that was looked at."""

    labels: Labels
    scores: tuple[tuple[int, float], ...]


def candidates(count: int, options: SelectionOptions) -> range:
    """Numbers of groups that may be looked at for `count` robots. Raises ValueError where the bounds cannot be met."""
    numbers = options.bounds.numbers(count)
    if options.criterion == "paper" and len(numbers) > 1 and numbers.start == 1:
        return range(2, numbers.stop)
    return numbers


def choose(S: Floats, options: SelectionOptions, start: Labels | None = None) -> Choice:
    """Part the robots of a similarity matrix (N, N) into the number of groups with the highest score.

    Ties go to the smaller number; by gain they move nobody. No robots have no groups and no scores. `start` (N,) are
    labels, any whole numbers, that gain begins with. Raises ValueError for a matrix that is not symmetric, from 0 to 1
    and 1 on its diagonal, for labels that do not fit it, and for bounds that no grouping satisfies.
    """
    S = np.ascontiguousarray(S, np.float64)
    _check(S)
    if start is not None and (start.shape != (len(S),) or start.dtype.kind not in "iu"):
        raise ValueError(
            f"{len(S)} robots start with as many whole numbers for labels, not {start.dtype} {start.shape}"
        )
    if not len(S):
        return Choice(np.zeros(0, np.intp), ())
    numbers = candidates(len(S), options)
    match options.criterion:
        case "adaptive":
            return _adaptive(S, options, numbers)
        case "gain":
            return _by_gain(S, options, numbers, start)
        case "eigengap":
            return _by_eigengap(S, options, numbers)
        case _:
            return _by_score(S, options, numbers)


def contributions(S: Floats, options: SelectionOptions) -> Contributions:
    """What each robot contributes to the score of a grouping, by the criterion.

    Eigengap scores numbers and not groupings: silhouette stands in for it.
    """
    criterion = options.criterion
    if criterion == "gain":
        # Computed once, and only if somebody asks.
        expected = cache(lambda: scores.expectations(S, options.stranger, GAIN))
        return lambda labels: scores.gain(S, labels, expected())
    if criterion == "modularity":
        return lambda labels: scores.modularity(S, labels)
    if criterion in ("fiedler", "paper"):
        return lambda labels: scores.connectivity(S, labels)
    return lambda labels: scores.silhouette(S, labels, options.stranger)


def _check(S: Floats) -> None:
    if S.ndim != 2 or S.shape[0] != S.shape[1]:
        raise ValueError(f"a similarity matrix is square, not {S.shape}")
    if _sound(S):
        return
    astray = np.argwhere(~np.isfinite(S))
    if len(astray):
        i, j = astray[0].tolist()
        raise ValueError(f"similarities are finite, that of rows {i} and {j} is {S[i, j]}")
    raise ValueError("a similarity matrix is symmetric, lies from 0 to 1, and is 1 on its diagonal")


@compiled
def _sound(S: Floats) -> bool:
    count = len(S)
    for i in range(count):
        if S[i, i] != 1:
            return False
    # Block by block, so that the mirror image is read line by line too.
    for top in range(0, count, _BLOCK):
        for left in range(0, top + 1, _BLOCK):
            sound = True
            for i in range(top, min(top + _BLOCK, count)):
                for j in range(left, min(left + _BLOCK, i)):
                    sound &= (S[i, j] == S[j, i]) & (S[i, j] >= 0) & (S[i, j] <= 1)
            if not sound:
                return False
    return True


def _adaptive(S: Floats, options: SelectionOptions, numbers: range) -> Choice:
    """The best of fine groups and of all that come of merging them; where those are too few, Ng-Jordan-Weiss'.

    In swarms that are not too large all that come of merging robots one by one, down to the fine groups, are looked at
    too.
    """
    company = scores.best_company(S)
    fine = moves.settle(S, scores.expected_of(company, options.stranger, FINE), np.arange(len(S)))
    formed = int(fine.max()) + 1
    expected = scores.expected_of(company, options.stranger, MERGE)
    if len(S) <= ONE_BY_ONE_UP_TO:
        ladders = [_Ladder.of(S, expected, np.arange(len(S)), formed + 1)] if formed < len(S) else []
    elif formed < numbers.start:
        return _by_score(S, options, numbers[:1])
    else:
        ladders = []
    ladders.append(_Ladder.of(S, expected, fine, 1))
    if options.min_group_size > 1:
        found: _Found = {}
        merged = (ladder.at(m) for ladder in ladders for m in ladder.numbers if m in numbers)
        _compare(found, (_sized(S, labels, options, numbers) for labels in merged), contributions(S, options))
        return _best_of(found)
    told = {m: score for ladder in ladders for m, score in ladder.scores(S, options.stranger).items() if m in numbers}
    best = _highest(told)
    return Choice(next(ladder.at(best) for ladder in ladders if best in ladder.numbers), tuple(sorted(told.items())))


@dataclass(frozen=True, slots=True, eq=False)
class _Ladder:
    """Groups with labels (N,), merged step by step."""

    labels: Labels
    steps: NDArray[np.intp]

    @classmethod
    def of(cls, S: Floats, expected: Floats, labels: Labels, least: int) -> _Ladder:
        return cls(labels, merging.merge_down(S, expected, labels, least)[0])

    @property
    def numbers(self) -> range:
        formed = int(self.labels.max()) + 1
        return range(formed - len(self.steps), formed + 1)

    def at(self, m: int) -> Labels:
        return canonical(merging.after(self.labels, self.steps[: self.numbers[-1] - m]), len(self.labels))

    def scores(self, S: Floats, stranger: float) -> dict[int, float]:
        told = merging.silhouettes(S, self.labels, self.steps, stranger).tolist()
        return dict(zip(reversed(self.numbers), told, strict=True))


def _by_score(S: Floats, options: SelectionOptions, numbers: range) -> Choice:
    """The best of Ng-Jordan-Weiss' groupings."""
    spectrum, score_of = Spectrum.of(S, numbers[-1]), contributions(S, options)
    looked_at = list(numbers) if len(S) <= _ALL_UP_TO.get(options.criterion, _ALL_ELSE) else _spread(numbers)
    found: _Found = {}
    nearby = looked_at
    while nearby:
        _compare(found, (_sized(S, partition(spectrum, m), options, numbers) for m in nearby), score_of)
        nearby = _about(_highest(_told(found)), looked_at)
        looked_at = sorted({*looked_at, *nearby})
    return _best_of(found)


def _by_eigengap(S: Floats, options: SelectionOptions, numbers: range) -> Choice:
    """The number after which eigenvalues fall most; beyond the last of N they fall to 0."""
    spectrum = Spectrum.of(S)
    gaps = -np.diff(np.append(np.maximum(spectrum.values, 0.0), 0.0))
    told = {m: float(gaps[m - 1]) for m in numbers}
    labels = _sized(S, partition(spectrum, _highest(told)), options, numbers)
    return Choice(canonical(labels, len(S)), tuple(told.items()))


def _by_gain(S: Floats, options: SelectionOptions, numbers: range, start: Labels | None) -> Choice:
    """Where local moves end; parted further by Ng-Jordan-Weiss, or merged, as far as the bounds demand."""
    expected = scores.expectations(S, options.stranger, GAIN)
    labels = moves.settle(S, expected, np.arange(len(S)) if start is None else dense(start))
    if labels.max() + 1 < numbers.start:
        labels = partition(Spectrum.of(S, numbers.start), numbers.start)
    labels = canonical(_sized(S, labels, options, numbers), len(S))
    formed = int(labels.max()) + 1
    least = max(numbers.start, min(numbers[-1], int(_TOLD_SHARE * formed)))
    steps, gains = merging.merge_down(S, expected, labels, least)
    totals = float(scores.gain(S, labels, expected).sum()) + np.append(0.0, np.cumsum(gains))
    told = {formed - k: total for k, total in enumerate(totals.tolist()) if formed - k in numbers}
    labels = merging.after(labels, steps[: max(0, formed - numbers[-1])])
    return Choice(canonical(labels, formed), tuple(sorted(told.items())))


def _compare(found: _Found, groupings: Iterable[Labels], score_of: Contributions) -> None:
    """Enter groupings where they score best of those with as many groups."""
    for labels in groupings:
        named = canonical(labels, len(labels))
        formed, score = int(named.max()) + 1, float(score_of(named).sum())
        if formed not in found or score > found[formed][0]:
            found[formed] = (score, named)


def _told(found: _Found) -> dict[int, float]:
    return {m: score for m, (score, _) in sorted(found.items())}


def _best_of(found: _Found) -> Choice:
    told = _told(found)
    return Choice(found[_highest(told)][1], tuple(told.items()))


def _highest(told: Mapping[int, float]) -> int:
    """The smallest number that scores best."""
    best = max(told.values())
    return min(m for m, score in told.items() if score >= best - _TIE * max(1.0, abs(best)))


def _spread(numbers: range) -> list[int]:
    """Some numbers, each by a quarter more than the last, and the largest."""
    kept = [numbers.start]
    while kept[-1] < numbers[-1]:
        kept.append(min(max(kept[-1] + 1, round(_SPREAD * kept[-1])), numbers[-1]))
    return kept


def _about(best: int, looked_at: list[int]) -> list[int]:
    """Numbers halfway from the best to those next to it that were looked at, as long as something lies between."""
    place = int(np.searchsorted(looked_at, best))
    beside = looked_at[max(0, place - 1) : place] + looked_at[place + 1 : place + 2]
    halfway = {(best + other) // 2 if other < best else (best + other + 1) // 2 for other in beside}
    return sorted(halfway - set(looked_at))


def _sized(S: Floats, labels: Labels, options: SelectionOptions, numbers: range) -> Labels:
    """Groups as large as they must be at least, and not fewer than there may be."""
    if options.min_group_size == 1:
        return labels
    return with_least_size(S, labels, options.min_group_size, numbers.start)
