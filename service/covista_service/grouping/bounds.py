"""How many groups may there be, and how small: what is asked for, and what so many robots can form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from covista_service.grouping.k_means import Labels
from covista_service.grouping.similarity import Floats

Groups = Literal["auto"] | int | tuple[int, int]


@dataclass(frozen=True, slots=True)
class Bounds:
    """`groups`: auto, a number, or (least, largest); and how many robots a group has at least."""

    groups: Groups = "auto"
    min_group_size: int = 1

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
    `least`; else it takes in, one by one, whom it suits best compared with the group that can spare him. Labels (N,)
    from 0 to M - 1, without gaps, in no order.
    """
    labels = np.unique(labels, return_inverse=True)[1].astype(np.intp)
    while True:
        sizes = np.bincount(labels)
        small = int(sizes.argmin())
        if sizes[small] >= size:
            return labels
        means = _means(S, labels, len(sizes))
        if len(sizes) > least:
            to = means[labels == small].mean(axis=0)
            to[small] = -np.inf
            labels[labels == small] = int(to.argmax())
            labels = np.unique(labels, return_inverse=True)[1].astype(np.intp)
        else:
            better = means[:, small] - means[np.arange(len(S)), labels]
            better[(sizes[labels] <= size) | (labels == small)] = -np.inf
            labels[int(better.argmax())] = small


def _means(S: Floats, labels: NDArray[np.intp], m: int) -> Floats:
    """Mean similarity (N, m) of every robot to the members of each group, itself left out."""
    member = (labels[:, None] == np.arange(m)).astype(np.float64)
    own = member * np.diag(S)[:, None]
    result: Floats = (S @ member - own) / np.maximum(member.sum(axis=0) - member, 1.0)
    return result
