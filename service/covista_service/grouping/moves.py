"""Groups by local moves: each robot goes where it gains most, groups that gain by it merge; M comes out by itself.

No eigenvectors: with N robots and few plausible companions of each, the work is one look at the matrix.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.grouping.k_means import Labels, canonical
from covista_service.grouping.similarity import Floats

# A gain below this is rounding.
_LEAST = 1e-9
_ROUNDS = 50
# Room for so many friends of each robot, to begin with.
_FEW = 8


@compiled
def settle(S: Floats, expected: Floats, start: Labels) -> Labels:
    """Labels (N,), numbered as they first appear, at which no robot gains by moving and no two groups by merging.

    S (N, N) similarities, `expected` (N,) what robots may expect of a companion (`scores.expectations`): a pair inside
    a group gains s_ij - (e_i + e_j)/2. `start` (N,) labels from 0 to N - 1 to begin with: all alone, or the groups on
    show. Robots move in the order of what they expect, of those who expect no more than of a stranger in the order of
    what they have in common with all, so that their order in the matrix does not matter.
    """
    count = len(S)
    labels = start.copy()
    if count < 2:
        return labels
    begin, friends, in_common = _friends(S, expected)
    following, first, size = _chains(labels)
    order = np.argsort(-in_common, kind="mergesort")
    order = order[np.argsort(-expected[order], kind="mergesort")]
    for _ in range(_ROUNDS):
        _move_all(S, expected, begin, friends, order, labels, following, first, size)
        if not _merge_best(S, expected, begin, friends, labels, following, first, size):
            break
    return canonical(labels, count)


@compiled
def _friends(S: Floats, expected: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp], Floats]:
    """Whose company exceeds expectations: robots `friends[begin[i]:begin[i + 1]]` of robot i.

    And what each has in common with all (N,), from the same look at the matrix.
    """
    count, found = len(S), 0
    begin, friends = np.zeros(count + 1, np.intp), np.empty(_FEW * count, np.intp)
    in_common = np.zeros(count)
    for i in range(count):
        for j in range(count):
            in_common[i] += S[i, j]
        if found + count > len(friends):
            friends = np.concatenate((friends, np.empty(len(friends), np.intp)))
        own = expected[i]
        for j in range(count):
            if 2 * S[i, j] > own + expected[j] and j != i:
                friends[found] = j
                found += 1
        begin[i + 1] = found
    return begin, friends[:found], in_common


@compiled
def _chains(labels: Labels) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """The members of group g as a chain: first[g], then following[.] until -1; and the sizes of groups."""
    count = len(labels)
    following, first, size = np.full(count, -1, np.intp), np.full(count, -1, np.intp), np.zeros(count, np.intp)
    for i in range(count):
        _enter(i, labels[i], following, first, size)
    return following, first, size


@compiled
def _enter(i: int, group: int, following: Labels, first: Labels, size: Labels) -> None:
    following[i] = first[group]
    first[group] = i
    size[group] += 1


@compiled
def _leave(i: int, group: int, following: Labels, first: Labels, size: Labels) -> None:
    size[group] -= 1
    if first[group] == i:
        first[group] = following[i]
        return
    before = first[group]
    while following[before] != i:
        before = following[before]
    following[before] = following[i]


@compiled
def _worth(S: Floats, expected: Floats, i: int, group: int, following: Labels, first: Labels) -> float:
    """What robot i gains with the members of a group, itself left out."""
    total = 0.0
    j = first[group]
    while j >= 0:
        if j != i:
            total += S[i, j] - (expected[i] + expected[j]) / 2
        j = following[j]
    return total


@compiled
def _move_all(
    S: Floats,
    expected: Floats,
    begin: Labels,
    friends: Labels,
    order: Labels,
    labels: Labels,
    following: Labels,
    first: Labels,
    size: Labels,
) -> None:
    """Move robots to where they gain most, a group of their own included, until nobody gains by it."""
    count = len(S)
    seen = np.full(count, -1, np.intp)
    for round_ in range(_ROUNDS):
        moved = False
        for i in order:
            own = labels[i]
            best, most = own, _worth(S, expected, i, own, following, first)
            if most < -_LEAST:
                best, most = -1, 0.0
            stamp = round_ * count + i
            seen[own] = stamp
            for f in range(begin[i], begin[i + 1]):
                group = labels[friends[f]]
                # Without a friend in it a group cannot be a gain.
                if seen[group] != stamp:
                    seen[group] = stamp
                    worth = _worth(S, expected, i, group, following, first)
                    if worth > most + _LEAST:
                        best, most = group, worth
            if best != own:
                if best < 0:
                    best = _free(size)
                _leave(i, own, following, first, size)
                _enter(i, best, following, first, size)
                labels[i] = best
                moved = True
        if not moved:
            return


@compiled
def _free(size: Labels) -> int:
    """The number of an empty group."""
    for group in range(len(size)):
        if size[group] == 0:
            return group
    return -1


@compiled
def _merge_best(
    S: Floats,
    expected: Floats,
    begin: Labels,
    friends: Labels,
    labels: Labels,
    following: Labels,
    first: Labels,
    size: Labels,
) -> bool:
    """Merge the pairs of groups that are each other's best and gain by it; False if there are none."""
    count = len(S)
    best, most = np.full(count, -1, np.intp), np.full(count, _LEAST)
    seen = np.full(count, -1, np.intp)
    for group in range(count):
        i = first[group]
        while i >= 0:
            for f in range(begin[i], begin[i + 1]):
                other = labels[friends[f]]
                if other < group and seen[other] != group:
                    seen[other] = group
                    gained = _worth_together(S, expected, group, other, following, first)
                    if gained > most[group]:
                        best[group], most[group] = other, gained
                    if gained > most[other]:
                        best[other], most[other] = group, gained
            i = following[i]
    merged = False
    for group in range(count):
        other = best[group]
        if other > group and best[other] == group:
            while first[other] >= 0:
                i = first[other]
                _leave(i, other, following, first, size)
                _enter(i, group, following, first, size)
                labels[i] = group
            merged = True
    return merged


@compiled
def _worth_together(S: Floats, expected: Floats, group: int, other: int, following: Labels, first: Labels) -> float:
    """What two groups gain by merging."""
    gained = 0.0
    j = first[other]
    while j >= 0:
        gained += _worth(S, expected, j, group, following, first)
        j = following[j]
    return gained
