"""k-means of unit rows without a random number: orthogonal seeds from many starts, the cheapest few run out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.grouping.similarity import Floats

Labels = NDArray[np.intp]
# k-means runs from the best few seedings.
_FEW = 3
_ROUNDS = 30
_ROUNDING = 1e-9


@compiled
def k_means(rows: Floats, m: int, starts: NDArray[np.intp]) -> Labels:
    """Part unit rows (N, m) into exactly m groups, 1 <= m <= N; labels (N,) from 0, numbered as they first appear.

    One seeding begins at each of the rows `starts`; the next seed is the row whose largest |cosine| with the seeds so
    far is least. The seedings are judged by the squared distance of all rows to their nearest seed.
    """
    seeds, cost = _seed(np.dot(rows, rows.T), m, starts)
    best, least = np.empty(0, np.intp), np.inf
    for start in _cheapest(seeds, cost):
        labels, cost_of_run = _lloyd(rows, rows[seeds[start]])
        # Of equals, to rounding, the one with the better seeds.
        if cost_of_run < least - _ROUNDING:
            best, least = labels, cost_of_run
    return canonical(best, m)


def dense(labels: Labels) -> Labels:
    """The same groups with labels (N,) from 0 without a gap, whatever numbers they had."""
    return np.unique(labels, return_inverse=True)[1].astype(np.intp)


@compiled
def canonical(labels: Labels, m: int) -> Labels:
    """The same m groups, numbered in the order of their first robots; `labels` (N,) lie from 0 to m - 1."""
    number, used, renamed = np.full(m, -1, np.intp), 0, np.empty(len(labels), np.intp)
    for i in range(len(labels)):
        if number[labels[i]] < 0:
            number[labels[i]] = used
            used += 1
        renamed[i] = number[labels[i]]
    return renamed


@compiled
def _cheapest(seeds: NDArray[np.intp], cost: Floats) -> NDArray[np.intp]:
    """The few cheapest seedings that differ in their seeds, the cheapest first."""
    m = seeds.shape[1]
    order = np.argsort(np.round(cost / _ROUNDING), kind="mergesort")
    kept, sets, found = np.empty(_FEW, np.intp), np.empty((_FEW, m), np.intp), 0
    for start in order:
        ordered, fresh = np.sort(seeds[start]), True
        for held in range(found):
            fresh = fresh and not (sets[held] == ordered).all()
        if fresh:
            kept[found], sets[found] = start, ordered
            found += 1
            if found == _FEW:
                break
    return kept[:found]


@compiled
def _seed(cosine: Floats, m: int, starts: NDArray[np.intp]) -> tuple[NDArray[np.intp], Floats]:
    """Seeds (starts, m) and, less a constant, half the cost of each seeding (starts,)."""
    count = len(cosine)
    seeds, cost = np.empty((len(starts), m), np.intp), np.empty(len(starts))
    for s in range(len(starts)):
        last = starts[s]
        taken, nearest = np.zeros(count), np.full(count, -np.inf)
        for step in range(m):
            seeds[s, step] = last
            taken[last] = np.inf
            following, least = last, np.inf
            for i in range(count):
                c = cosine[last, i]
                nearest[i] = max(nearest[i], c)
                taken[i] = max(taken[i], abs(c))
                if taken[i] < least:
                    following, least = i, taken[i]
            last = following
        cost[s] = -nearest.sum()
    return seeds, cost


@compiled
def _lloyd(rows: Floats, centres: Floats) -> tuple[Labels, float]:
    """Lloyd's rounds from centres (m, m), none of whose groups may be empty: labels (N,), and their cost."""
    count, m = rows.shape
    labels = np.full(count, -1, np.intp)
    for _ in range(_ROUNDS):
        # |row|^2 is the same for all centres.
        distance = (centres**2).sum(axis=1) - 2 * np.dot(rows, centres.T)
        fresh = np.empty(count, np.intp)
        for i in range(count):
            fresh[i] = distance[i].argmin()
        _occupy(fresh, distance)
        if (fresh == labels).all():
            break
        labels = fresh
        centres = np.zeros((m, m))
        sizes = np.zeros(m)
        for i in range(count):
            sizes[labels[i]] += 1
            for axis in range(m):
                centres[labels[i], axis] += rows[i, axis]
        for k in range(m):
            for axis in range(m):
                centres[k, axis] /= sizes[k]
    cost = 0.0
    for i in range(count):
        for axis in range(m):
            cost += (rows[i, axis] - centres[labels[i], axis]) ** 2
    return labels, cost


@compiled
def _occupy(labels: Labels, distance: Floats) -> None:
    """Give every empty group the row that lies farthest from its own centre among those that can be spared."""
    count, m = distance.shape
    sizes = np.zeros(m, np.int64)
    for i in range(count):
        sizes[labels[i]] += 1
    for empty in range(m):
        if sizes[empty]:
            continue
        row, farthest = -1, -np.inf
        for i in range(count):
            if sizes[labels[i]] > 1 and (row < 0 or distance[i, labels[i]] > farthest):
                row, farthest = i, distance[i, labels[i]]
        sizes[labels[row]] -= 1
        labels[row] = empty
        sizes[empty] = 1
