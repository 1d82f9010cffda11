"""How many groups may there be, and how small: what is asked for, and what so many robots can form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.grouping.k_means import Labels, dense
from covista_service.grouping.similarity import Floats

Groups = Literal["auto"] | int | tuple[int, int]


@dataclass(frozen=True, slots=True)
class Bounds:
    """`groups`: auto, a number, or (least, largest); and how many robots a group has at least."""

    groups: Groups = "auto"
    min_group_size: int = 1

    def __post_init__(self) -> None:
        """Raise ValueError for what is of no such kind."""
        groups = self.groups
        pair = isinstance(groups, tuple) and len(groups) == 2 and all(isinstance(each, int) for each in groups)
        if groups != "auto" and not isinstance(groups, int) and not pair:
            raise ValueError(f"groups are auto, a number, or (least, largest), not {groups!r}")
        if not isinstance(self.min_group_size, int):
            raise ValueError(f"the least size of a group is a number of robots, not {self.min_group_size!r}")

    @property
    def least(self) -> int:
        """The smallest number of groups asked for."""
        if self.groups == "auto":
            return 1
        return self.groups if isinstance(self.groups, int) else self.groups[0]

    def numbers(self, count: int) -> range:
        """Numbers of groups to look at for `count` robots; raises ValueError where no grouping satisfies the bounds.

        A largest number beyond what they can form is cut to that.
        """
        refusal = self.refusal(count)
        if refusal is not None:
            raise ValueError(refusal)
        if isinstance(self.groups, int):
            return range(self.groups, self.groups + 1)
        largest = count if self.groups == "auto" else self.groups[1]
        return range(self.least, min(largest, max(1, count // self.min_group_size)) + 1)

    def refusal(self, count: int) -> str | None:
        """Why `count` robots cannot be grouped like this, None if they can."""
        if self.min_group_size < 1:
            return f"a group has at least one robot, not {self.min_group_size}"
        if isinstance(self.groups, tuple) and not 1 <= self.groups[0] <= self.groups[1]:
            least, largest = self.groups
            return f"bounds on the number of groups are 1 <= least <= largest, not {least} and {largest}"
        robots = f"{count} robot{'s' * (count != 1)}"
        if not 1 <= self.least <= count:
            return f"{robots} cannot form {self.least} groups"
        if self.least * self.min_group_size > count:
            groups = f"{self.least} group{'s' * (self.least != 1)}"
            return f"{robots} cannot form {groups} of at least {self.min_group_size}"
        return None

    def loosened(self, count: int) -> Bounds:
        """The nearest bounds that `count` > 0 robots can satisfy: the number of groups counts more than their size."""
        least = min(self.least, count)
        groups = self.groups if least == self.least else least
        return replace(self, groups=groups, min_group_size=min(self.min_group_size, count // least))


def with_least_size(S: Floats, labels: Labels, size: int, least: int) -> Labels:
    """Groups of at least `size` robots, and at least `least` groups, out of others: `size * least` <= N.

    The smallest group merges into the one that it has most in common with on average, as long as there are more than
    `least`; else it takes in, one by one, whom it suits best compared with the group that can spare him. Of groups as
    small that one does first which it suits best. Labels (N,) from 0 to M - 1, without gaps, in no order.
    """
    enlarged = dense(labels)
    _merge_smallest(S, enlarged, size, least)
    enlarged = dense(enlarged)
    _take_in(S, enlarged, size)
    return enlarged


@compiled
def _merge_smallest(S: Floats, labels: Labels, size: int, least: int) -> None:
    """Merge, in place, as long as there are small groups and more than the least number of them."""
    common, sizes = _in_common(S, labels)
    m = len(sizes)
    between = np.zeros((m, m))
    for i in range(len(S)):
        between[labels[i]] += common[i]
    for _ in range(m - least):
        smallest = _smallest(sizes)
        if smallest >= size:
            return
        small, to = _best_merger(between, sizes, smallest)
        between[to] += between[small]
        between[:, to] = between[to]
        sizes[to] += smallest
        sizes[small] = 0
        for i in range(len(S)):
            if labels[i] == small:
                labels[i] = to


@compiled
def _best_merger(between: Floats, sizes: NDArray[np.intp], smallest: int) -> tuple[int, int]:
    """Of groups that have `between` (m, m) in common the smallest that has most with another, and that other."""
    small, to, most = -1, -1, -np.inf
    for a in range(len(sizes)):
        if sizes[a] == smallest:
            for b in range(len(sizes)):
                if b != a and sizes[b] and between[a, b] / sizes[b] > most:
                    small, to, most = a, b, between[a, b] / sizes[b]
    return small, to


@compiled
def _take_in(S: Floats, labels: Labels, size: int) -> None:
    """Let small groups grow, in place, by robots of groups that can spare them."""
    common, sizes = _in_common(S, labels)
    while True:
        smallest = _smallest(sizes)
        if smallest >= size:
            return
        robot, to, most = -1, -1, -np.inf
        for i in range(len(S)):
            own = labels[i]
            if sizes[own] > size:
                left = (common[i, own] - S[i, i]) / (sizes[own] - 1)
                for group in range(len(sizes)):
                    if sizes[group] == smallest and common[i, group] / smallest - left > most:
                        robot, to, most = i, group, common[i, group] / smallest - left
        own = labels[robot]
        sizes[own] -= 1
        sizes[to] += 1
        labels[robot] = to
        common[:, own] -= S[robot]
        common[:, to] += S[robot]


@compiled
def _in_common(S: Floats, labels: Labels) -> tuple[Floats, NDArray[np.intp]]:
    """What each robot has in common with the members of each group (N, m), itself included; and the groups' sizes."""
    m = labels.max() + 1
    common, sizes = np.zeros((len(S), m)), np.zeros(m, np.intp)
    for i in range(len(S)):
        sizes[labels[i]] += 1
        for j in range(len(S)):
            common[i, labels[j]] += S[i, j]
    return common, sizes


@compiled
def _smallest(sizes: NDArray[np.intp]) -> int:
    """The size of the smallest group that is not empty."""
    smallest: int = sizes.max()
    for size in sizes:
        if 0 < size < smallest:
            smallest = size
    return smallest
