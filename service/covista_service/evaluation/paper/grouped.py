"""Groups as the station forms them, for scenarios whose overlaps and distances are known."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.grouping import similarity
from covista_service.grouping.continuity import Members, follow
from covista_service.grouping.selection import SelectionOptions, choose
from covista_service.grouping.similarity import Floats, Sigma

Labels = NDArray[np.intp]
# Numbers of the cameras of each group, from 1, as the paper prints them.
Groups = tuple[tuple[int, ...], ...]
_HALVINGS = 12


@dataclass(frozen=True, slots=True)
class Way:
    """How groups are formed: the range of Eq. 15, and how many there are."""

    sigma: Sigma
    selection: SelectionOptions


def into(count: int) -> Way:
    """The paper's way to a given number of groups: Ng-Jordan-Weiss."""
    return Way("std", SelectionOptions(count, "fiedler"))


# Tables II and III: two groups.
TWO = into(2)
# Fig. 8: as many as Eq. 17 says.
ADAPTIVE = Way("std", SelectionOptions("auto", "fiedler"))
# What a station does that nobody has told otherwise.
STATION = Way("shared", SelectionOptions())


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Row i of `overlap` (N, N): share of i's image that j sees; `distance_m` (N, N)."""

    overlap: Floats
    distance_m: Floats

    @property
    def mutual(self) -> Floats:
        """(q_i + q_j)/2 (N, N), the overlap's part in Eq. 16."""
        return (self.overlap + self.overlap.T) / 2

    @property
    def closeness(self) -> Floats:
        """d_ij (N, N) of Eq. 15, sigma the standard deviation of the distances: what Eq. 16 is for alpha = 0."""
        return self.similarity(0.0, TWO)

    def similarity(self, alpha: float, way: Way) -> Floats:
        """s_ij (N, N) of Eq. 16."""
        return similarity.matrix(self.distance_m, self.overlap, alpha, way.sigma)


def labels(seen: Seen, alpha: float, way: Way) -> Labels:
    """Which group each camera is in, (N,), from 0 in the order of their first cameras."""
    return choose(seen.similarity(alpha, way), way.selection).labels


def lead(seen: Seen, alpha: float, way: Way) -> float:
    """By how much of its score the chosen number of groups is ahead of the next best."""
    first, second, *_ = sorted((score for _, score in choose(seen.similarity(alpha, way), way.selection).scores))[::-1]
    return (first - second) / first


def groups(seen: Seen, alpha: float, way: Way) -> Groups:
    """Who is together with whom."""
    return members(labels(seen, alpha, way))


def members(found: Labels) -> Groups:
    """The cameras of each group, numbered from 1."""
    return tuple(tuple((np.flatnonzero(found == k) + 1).tolist()) for k in range(int(found.max()) + 1))


def text(found: Groups) -> str:
    """Groups as the paper prints them."""
    return " ".join("{" + ",".join(map(str, group)) + "}" for group in found)


def switches(seen: Seen, way: Way, steps: int = 200) -> list[float]:
    """Where the groups change as alpha goes from 0 to 1; two changes within 1/steps that undo each other are missed."""
    found: list[float] = []
    low, before = 0.0, groups(seen, 0.0, way)
    for k in range(1, steps + 1):
        high = k / steps
        after = groups(seen, high, way)
        if after != before:
            found.append(_switch(seen, way, low, high))
        low, before = high, after
    return found


def _switch(seen: Seen, way: Way, low: float, high: float) -> float:
    """The first change of groups between two alphas, by bisection."""
    before = groups(seen, low, way)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if groups(seen, middle, way) == before:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def within(values: Floats, found: Labels) -> float:
    """Mean over the groups of the mean value of their pairs; `values` (N, N), symmetric. 0 where all stand alone."""
    means = []
    for k in range(int(found.max()) + 1):
        rows = np.flatnonzero(found == k)
        if len(rows) > 1:
            above = np.triu_indices(len(rows), 1)
            means.append(float(values[np.ix_(rows, rows)][above].mean()))
    return float(np.mean(means)) if means else 0.0


def followed(snapshots: Sequence[Groups]) -> Iterator[dict[str, tuple[int, ...]]]:
    """The groups of each snapshot by label, and labels stay with their groups as in the station."""
    held: dict[str, Members] = {}
    next_label = 1
    for found in snapshots:
        following = follow(held, [frozenset(f"{camera:03}" for camera in group) for group in found], next_label)
        held, next_label = following.groups, following.next_label
        yield {label: tuple(sorted(map(int, group))) for label, group in held.items()}
