"""How many groups? Eq. 17: the number at which the groups hold together best."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from covista_service.grouping.similarity import Floats
from covista_service.grouping.spectral import Labels, Spectrum, partition

Groups = Literal["auto"] | int | tuple[int, int]
Criterion = Literal["fiedler", "paper"]
_Members = tuple[int, ...]
# Scores closer than this are a tie.
_TIE = 1e-9


@dataclass(frozen=True, slots=True)
class SelectionOptions:
    """`groups`: auto, a number, or (least, largest). Criterion: `fiedler` admits one group, `paper` starts at two."""

    groups: Groups = "auto"
    criterion: Criterion = "fiedler"


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """Labels (N,) of the chosen grouping, and (number of groups, score) of every number that was looked at."""

    labels: Labels
    scores: tuple[tuple[int, float], ...]


def candidates(count: int, options: SelectionOptions) -> range:
    """Numbers of groups to look at for `count` robots.

    Bounds are cut to what `count` robots can form; a fixed number beyond it raises ValueError.
    """
    if isinstance(options.groups, int):
        if not 1 <= options.groups <= count:
            raise ValueError(f"{count} robots cannot form {options.groups} groups")
        return range(options.groups, options.groups + 1)
    least, largest = (1, count) if options.groups == "auto" else options.groups
    if not 1 <= least <= largest:
        raise ValueError(f"bounds on the number of groups are 1 <= least <= largest, not {least} and {largest}")
    if options.criterion == "paper":
        least = max(least, min(2, largest))
    return range(min(least, count), min(largest, count) + 1)


def choose(S: Floats, options: SelectionOptions) -> Choice:
    """Part the robots of a similarity matrix (N, N) into the number of groups with the highest score.

    Ties go to the smaller number. No robots have no groups and no scores.
    """
    if not len(S):
        return Choice(np.zeros(0, np.intp), ())
    numbers = candidates(len(S), options)
    spectrum = Spectrum.of(S)
    partitions = {m: partition(spectrum, m) for m in numbers}
    members = {m: members_of(labels, m) for m, labels in partitions.items()}
    fiedler = fiedler_values(S, (group for groups in members.values() for group in groups))
    # Eq. 17: the mean Fiedler value of the groups.
    scores = tuple((m, sum(fiedler[group] for group in groups) / m) for m, groups in members.items())
    best = max(score for _, score in scores)
    winner = next(m for m, score in scores if score >= best - _TIE * max(1.0, best))
    return Choice(partitions[winner], scores)


def members_of(labels: Labels, m: int) -> list[_Members]:
    """Row numbers of each of m groups."""
    groups: list[list[int]] = [[] for _ in range(m)]
    for row, label in enumerate(labels.tolist()):
        groups[label].append(row)
    return [tuple(group) for group in groups]


def fiedler_values(S: Floats, groups: Iterable[_Members]) -> dict[_Members, float]:
    """The second smallest eigenvalue of each group's Laplacian D - A; 0 for a robot alone.

    The same groups come up under many numbers of groups: each is solved once, all of one size together.
    """
    by_size: defaultdict[int, set[_Members]] = defaultdict(set)
    for group in groups:
        by_size[len(group)].add(group)
    values: dict[_Members, float] = dict.fromkeys(by_size.pop(1, ()), 0.0)
    for same in by_size.values():
        ordered = sorted(same)
        values.update(zip(ordered, _second_smallest(S, np.array(ordered)).tolist(), strict=True))
    return values


def _second_smallest(S: Floats, members: NDArray[np.intp]) -> Floats:
    """Fiedler values (g,) of g groups of one size, `members` (g, n)."""
    weights = S[members[:, :, None], members[:, None, :]]
    diagonal = np.arange(members.shape[1])
    laplacian = -weights
    # s_ii takes no part: it would stand in D and in A alike.
    laplacian[:, diagonal, diagonal] = 0.0
    laplacian[:, diagonal, diagonal] = -laplacian.sum(axis=2)
    return np.asarray(np.linalg.eigvalsh(laplacian)[:, 1], np.float64)
