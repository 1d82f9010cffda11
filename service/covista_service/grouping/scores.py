"""How good is a grouping? What each robot contributes to its score, by several measures.

A measure takes a similarity matrix S (N, N), s_ii = 1, and labels (N,) from 0 to M - 1 without a gap, and gives (N,):
the score of the grouping is the sum. Measures are functions of which robots stand together, not of the labels.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.grouping.k_means import Labels
from covista_service.grouping.similarity import Floats, check_alpha

Members = tuple[int, ...]
# What each robot adds (N,) to the score of a grouping with labels (N,) from 0 to M - 1.
Contributions = Callable[[Labels], Floats]
# Scores closer than this are a tie.
_ROUNDING = 1e-12


def outsider(alpha: float) -> float:
    """The similarity at which a robot is indifferent between company and none, .1 alpha + .5 (1 - alpha).

    Raises ValueError for an alpha that is none.
    """
    check_alpha(alpha)
    return 0.1 * alpha + 0.5 * (1 - alpha)


@compiled
def silhouette(S: Floats, labels: Labels, stranger: float) -> Floats:
    """How much nearer each robot is to its own group than to the next best, with a virtual outsider, /N.

    a_i is the mean similarity to the others of the own group, for a robot alone that of the outsider (`stranger`); b_i
    the highest mean similarity to another group, for a robot that is not alone at least the outsider's; each adds
    (a_i - b_i) / (1 - min(a_i, b_i)). So one group, and all robots alone, have a score as well.
    """
    count = len(S)
    m = labels.max() + 1 if count else 0
    sizes = np.zeros(m, np.int64)
    for i in range(count):
        sizes[labels[i]] += 1
    result = np.empty(count)
    for i in range(count):
        sums = np.zeros(m)
        for j in range(count):
            sums[labels[j]] += S[i, j]
        own = labels[i]
        alone = sizes[own] == 1
        a = stranger if alone else (sums[own] - S[i, i]) / (sizes[own] - 1)
        b = 0.0 if alone else stranger
        for k in range(m):
            if k != own:
                b = max(b, sums[k] / sizes[k])
        room = 1 - min(a, b)
        result[i] = (a - b) / room / count if room > _ROUNDING else 0.0
    return result


def expectations(S: Floats, stranger: float, demand: float) -> Floats:
    """What each robot may expect of a companion (N,): a share `demand` of the mean of its two largest similarities.

    And not less than the outsider's similarity.
    """
    return expected_of(best_company(S), stranger, demand)


def expected_of(company: Floats, stranger: float, demand: float) -> Floats:
    """The same from `best_company` (N,), which is what takes time."""
    result: Floats = np.maximum(demand * company, stranger)
    return result


@compiled
def best_company(S: Floats) -> Floats:
    """The mean of the two largest similarities of each robot to others (N,); 0 for a robot without others."""
    count = len(S)
    result = np.zeros(count)
    for i in range(count):
        first, second = -np.inf, -np.inf
        for j in range(count):
            if j != i:
                s = S[i, j]
                if s > first:
                    first, second = s, first
                elif s > second:
                    second = s
        if count > 1:
            result[i] = first if second == -np.inf else (first + second) / 2
    return result


@compiled
def gain(S: Floats, labels: Labels, expected: Floats) -> Floats:
    """Half of what pairs inside groups exceed expectations (N,) by: sum over mates of s_ij - (e_i + e_j)/2."""
    count = len(S)
    result = np.zeros(count)
    # Groups one after the other, so that nobody looks far for its mates.
    order = np.argsort(labels, kind="mergesort")
    begin = 0
    for end in range(1, count + 1):
        if end < count and labels[order[end]] == labels[order[begin]]:
            continue
        for i in order[begin:end]:
            for j in order[begin:end]:
                if j != i:
                    result[i] += (S[i, j] - (expected[i] + expected[j]) / 2) / 2
        begin = end
    return result


def modularity(S: Floats, labels: Labels) -> Floats:
    """Newman's modularity with weights s_ij, i != j: how much more groups hold than a random graph of equal degrees."""
    weights = S - np.diag(np.diag(S))
    degree = weights.sum(axis=1)
    total = degree.sum()
    if total <= 0:
        return np.zeros(len(S))
    member = (labels == np.arange(labels.max() + 1)[:, None]).astype(np.float64)
    inside = (weights * member[labels]).sum(axis=1)
    result: Floats = (inside - degree * (member @ degree)[labels] / total) / total
    return result


def connectivity(S: Floats, labels: Labels) -> Floats:
    """Mean Fiedler value of the groups (17), the group's divided among its robots; 0 for a robot alone."""
    groups = members_of(labels)
    values = fiedler_values(S, groups)
    result = np.empty(len(S))
    for group in groups:
        result[list(group)] = values[group] / (len(group) * len(groups))
    return result


def members_of(labels: Labels) -> list[Members]:
    """Row numbers of each group."""
    groups: list[list[int]] = [[] for _ in range(int(labels.max()) + 1 if len(labels) else 0)]
    for row, label in enumerate(labels.tolist()):
        groups[label].append(row)
    return [tuple(group) for group in groups]


def fiedler_values(S: Floats, groups: Iterable[Members]) -> dict[Members, float]:
    """The second smallest eigenvalue of each group's Laplacian D - A; 0 for a robot alone.

    The same groups come up under many numbers of groups: each is solved once, all of one size together.
    """
    by_size: defaultdict[int, set[Members]] = defaultdict(set)
    for group in groups:
        by_size[len(group)].add(group)
    values: dict[Members, float] = dict.fromkeys(by_size.pop(1, ()), 0.0)
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
