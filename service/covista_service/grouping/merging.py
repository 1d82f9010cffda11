"""Groups merged step by step, and what each step is worth: a grouping for every smaller number of groups."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.grouping.k_means import Labels
from covista_service.grouping.similarity import Floats

# A gain below this is rounding.
_LEAST = 1e-9


@compiled
def merge_down(S: Floats, expected: Floats, labels: Labels, least: int) -> tuple[NDArray[np.intp], Floats]:
    """Merge the two groups that lose least, again and again, until `least` are left.

    `labels` (N,) from 0 to M - 1. Returns steps (M - least, 2): the second label merges into the first; and what each
    step gains (M - least,), as a rule less than nothing.
    """
    m = labels.max() + 1
    between = _between(S, expected, labels, m)
    # With whom a group would merge best, among those with a smaller number, and what that would gain.
    partner, value = np.zeros(m, np.intp), np.full(m, -np.inf)
    for a in range(1, m):
        partner[a] = between[a, :a].argmax()
        value[a] = between[a, partner[a]]
    steps, gains = np.empty((m - least, 2), np.intp), np.empty(m - least)
    alive = np.ones(m, np.bool_)
    for step in range(m - least):
        b = -1
        for a in range(1, m):
            if alive[a] and (b < 0 or value[a] > value[b] + _LEAST):
                b = a
        a = partner[b]
        steps[step, 0], steps[step, 1], gains[step] = a, b, value[b]
        alive[b] = False
        for j in range(m):
            between[a, j] += between[b, j]
            between[j, a] = between[a, j]
            between[j, b] = -np.inf
        between[a, a] = -np.inf
        for j in range(1, m):
            if alive[j] and (j == a or partner[j] == a or partner[j] == b or value[j] < between[a, j]):
                partner[j] = between[j, :j].argmax()
                value[j] = between[j, partner[j]]
    return steps, gains


@compiled
def _between(S: Floats, expected: Floats, labels: Labels, m: int) -> Floats:
    """What every two of m groups would gain by merging (m, m)."""
    count = len(S)
    members, doubts = np.zeros(m), np.zeros(m)
    for i in range(count):
        members[labels[i]] += 1
        doubts[labels[i]] += expected[i] / 2
    between = np.zeros((m, m))
    for i in range(count):
        for j in range(count):
            between[labels[i], labels[j]] += S[i, j]
    for a in range(m):
        for b in range(m):
            between[a, b] -= doubts[a] * members[b] + doubts[b] * members[a]
        between[a, a] = -np.inf
    return between


@compiled
def after(labels: Labels, steps: NDArray[np.intp]) -> Labels:
    """Labels (N,) when the groups have merged like that."""
    into = np.arange(labels.max() + 1)
    for step in range(len(steps)):
        into[steps[step, 1]] = steps[step, 0]
    merged = np.empty(len(labels), np.intp)
    for i in range(len(labels)):
        group = labels[i]
        while into[group] != group:
            group = into[group]
        merged[i] = group
    return merged


@compiled
def silhouettes(S: Floats, labels: Labels, steps: NDArray[np.intp], stranger: float) -> Floats:
    """The silhouette (`scores.silhouette`) of groups, and after each step: (steps + 1,).

    After a step only robots are looked at anew whose own group or next best group has changed: to the others the merged
    group means no more than the better of the two did.
    """
    count, m = len(S), labels.max() + 1
    own, size = labels.copy(), np.zeros(m)
    for i in range(count):
        size[own[i]] += 1
    sums = _sums(S, own, m)
    # The groups that are left, in order.
    left = np.arange(m)
    # The next best group, what robots have in common with it on average, and what they contribute.
    other, most, value = np.full(count, -1, np.intp), np.full(count, -np.inf), np.zeros(count)
    for i in range(count):
        _next_best(sums, own, size, left, i, other, most)
        value[i] = _silhouette(sums[i, own[i]], most[i], size[own[i]], stranger)
    told = np.empty(len(steps) + 1)
    told[0] = value.mean()
    for step in range(len(steps)):
        a, b = steps[step]
        left = left[left != b]
        size[a] += size[b]
        for i in range(count):
            sums[i, a] += sums[i, b]
            if own[i] == b:
                own[i] = a
            if own[i] == a or other[i] == a or other[i] == b:
                _next_best(sums, own, size, left, i, other, most)
                value[i] = _silhouette(sums[i, own[i]], most[i], size[own[i]], stranger)
        told[step + 1] = value.mean()
    return told


@compiled
def _sums(S: Floats, labels: Labels, m: int) -> Floats:
    """What robots have in common with all of a group, themselves left out: (N, m)."""
    count = len(S)
    sums = np.zeros((count, m))
    for i in range(count):
        for j in range(count):
            if j != i:
                sums[i, labels[j]] += S[i, j]
    return sums


@compiled
def _next_best(
    sums: Floats, own: Labels, size: Floats, left: NDArray[np.intp], i: int, other: Labels, most: Floats
) -> None:
    """Enter the group, other than its own, that robot i has most in common with; -1 if there is none."""
    best, highest = -1, -np.inf
    for group in left:
        if group != own[i]:
            mean = sums[i, group] / size[group]
            if mean > highest:
                best, highest = group, mean
    other[i], most[i] = best, highest


@compiled
def _silhouette(own: float, most: float, size: float, stranger: float) -> float:
    """From the sum over the own group of `size` robots and the highest mean over another, -inf if there is none."""
    alone = size == 1
    a = stranger if alone else own / (size - 1)
    b = max(most, 0.0 if alone else stranger)
    room = 1 - min(a, b)
    return (a - b) / room if room > 1e-12 else 0.0
