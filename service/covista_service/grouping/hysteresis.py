"""Groups on show change for a clear gain, or when the change persists.

Overlaps are measured anew with every keyframe, each time a little differently; the best grouping of every moment would
send robots to and fro between groups that are about equally good.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from covista_service.compiled import compiled
from covista_service.grouping.continuity import Grouping, Members
from covista_service.grouping.k_means import Labels, dense
from covista_service.grouping.scores import Contributions
from covista_service.grouping.similarity import Floats

_Rows = NDArray[np.intp]
_NS_PER_S = 1_000_000_000
# Gains up to this share are rounding.
_NOTHING = 1e-9


@dataclass(frozen=True, slots=True)
class HysteresisOptions:
    """How much groups on show are held on to, and when a change that is proposed all the same is shown.

    New groups are made from a similarity a share `gain` of which are the groups on show (`held`): another grouping must
    gain more than that share. It is shown at once if the gain is clear, else when it has been proposed without a break
    for long enough. A gain is clear if every robot that moves brings more than `clear` times what a robot contributes
    on average. By 1 a robot that is found in another place altogether moves at once, and one on the verge waits.

    `persistence_s` outlasts a few keyframes, which come about once a second: noise seldom goes one way for five of
    them, and who drives from group to group is between them for longer. Evaluations may come ten times as often, but
    from the same keyframes. In 3 s a flickering pair passes often; 8 s leave a robot for as long in a group that it has
    left, and spare little more.
    """

    gain: float = 0.05
    persistence_s: float = 5.0
    clear: float = 1.0


@dataclass(frozen=True, slots=True)
class Pending:
    """A change that is proposed and not shown: groups on show, `before`, would become `after`; proposed since when."""

    before: frozenset[Members]
    after: frozenset[Members]
    since_ns: int


@dataclass(frozen=True, slots=True)
class Standing:
    """The groups to show, in the order of their first robots, and what is pending: to be handed in next time."""

    clusters: tuple[Members, ...]
    pending: tuple[Pending, ...] = ()


@compiled
def held(S: Floats, labels: Labels, gain: float) -> Floats:
    """Similarities (N, N) with the groups on show (N,) mixed in: (1 - gain) s_ij, and gain more for those together."""
    mixed = np.empty_like(S)
    for i in range(len(S)):
        mixed[i, i] = 1.0
        # Computed once for both: compiled for many columns at a time it need not round as for the few that are left.
        for j in range(i):
            mixed[i, j] = mixed[j, i] = (1 - gain) * S[i, j] + (gain if labels[i] == labels[j] else 0.0)
    return mixed


def weigh(
    shown: Grouping,
    robots: Sequence[str],
    labels: Labels,
    contributions: Contributions,
    now_ns: int,
    options: HysteresisOptions,
    pending: Iterable[Pending] = (),
) -> Standing:
    """Weigh the groups that are proposed, `labels` (N,) of `robots`, against those that are `shown`.

    Who has left is dropped and who is new joins, at once. What else differs falls into changes that have no group in
    common, and each is judged by itself: where a score is a sum over groups, the size of the swarm has no say in it. (A
    mean over groups, as Eq. 17 is, changes with their number for all.) `contributions` is asked only if there is such a
    change.

    Raises ValueError where robots and labels do not fit.
    """
    proposed = _checked(robots, labels)
    base = _placed(shown, robots, proposed)
    changes = _changes(base, proposed)
    if not changes:
        return _standing(robots, base)
    stayed = frozenset(robots) & frozenset().union(*shown.values())
    since_ns = {_among(each, stayed): each.since_ns for each in pending}
    before = contributions(base)
    average = float(np.abs(before).mean())
    result, waiting = base.copy(), list[Pending]()
    for rows in changes:
        first = Pending(_groups(robots, base, rows), _groups(robots, proposed, rows), now_ns)
        # A clock that was set back must not make a change wait until it is where it was.
        change = replace(first, since_ns=min(now_ns, since_ns.get(_among(first, stayed), now_ns)))
        after = base.copy()
        after[rows] = len(base) + proposed[rows]
        lasts = now_ns - change.since_ns >= options.persistence_s * _NS_PER_S
        wanted = options.clear * _moving(base[rows], proposed[rows])
        if lasts or _clear(contributions(dense(after)) - before, wanted, average):
            result[rows] = after[rows]
        else:
            waiting.append(change)
    return _standing(robots, result, waiting)


def _checked(robots: Sequence[str], labels: Labels) -> Labels:
    """Labels (N,) from 0 without a gap."""
    if labels.shape != (len(robots),):
        raise ValueError(f"{len(robots)} robots have as many labels, not {labels.shape}")
    if len(set(robots)) < len(robots):
        twice = sorted(robot for robot, times in Counter(robots).items() if times > 1)
        raise ValueError(f"every robot has one row: {', '.join(twice)} stands there more than once")
    return dense(labels)


def _placed(shown: Grouping, robots: Sequence[str], proposed: Labels) -> Labels:
    """Labels (N,) of the groups on show without those who have left and with those who are new.

    The newcomers of a proposed group go into the group on show that shares most robots with it (among equals the
    smallest one, then the one with the first robot), or into a group of their own where there is none.
    """
    groups = list(shown.values())
    group_of = {robot: group for group, members in enumerate(groups) for robot in members}
    base = np.array([group_of.get(robot, -1) for robot in robots], np.intp)
    new = base < 0
    for label in np.unique(proposed[new]).tolist():
        inside = proposed == label
        shared = Counter(base[inside & ~new].tolist())
        best = min(shared, key=lambda group: (-shared[group], len(groups[group]), min(groups[group])), default=None)
        base[inside & new] = len(groups) + label if best is None else best
    return dense(base)


def _changes(base: Labels, proposed: Labels) -> list[_Rows]:
    """Rows of each change: of the components of the graph in which groups of both that share robots are neighbours."""
    groups, wanted = base.max(initial=-1) + 1, proposed.max(initial=-1) + 1
    edges = np.divmod(np.unique(base * wanted + proposed), wanted)
    if len(edges[0]) == groups == wanted:
        return []
    count = groups + wanted
    graph = coo_array((np.ones(len(edges[0])), (edges[0], groups + edges[1])), (count, count))
    component = connected_components(graph, directed=False)[1]
    # Where there is one edge, the two groups are the same.
    changed = np.flatnonzero(np.bincount(component[edges[0]]) > 1)
    return [np.flatnonzero(component[base] == each) for each in changed]


def _moving(before: Labels, after: Labels) -> int:
    """How many of n robots stand elsewhere, labels (n,), if as many as can be stay where they are."""
    old, new = dense(before), dense(after)
    shared = np.zeros((int(old.max()) + 1, int(new.max()) + 1))
    np.add.at(shared, (old, new), 1.0)
    return len(before) - int(shared[linear_sum_assignment(shared, maximize=True)].sum())


def _clear(gains: Floats, wanted: float, average: float) -> bool:
    """Do robots gain (N,), all in all, more than `wanted` average robots contribute?

    Where nobody contributes anything there is nothing to judge by, and time must tell.
    """
    return average > 0 and float(gains.sum()) > max(wanted, _NOTHING) * average


def _groups(robots: Sequence[str], labels: Labels, rows: _Rows) -> frozenset[Members]:
    """The groups that the robots of `rows` stand in."""
    members: defaultdict[int, list[str]] = defaultdict(list)
    for row, label in zip(rows.tolist(), labels[rows].tolist(), strict=True):
        members[label].append(robots[row])
    return frozenset(map(frozenset, members.values()))


def _among(change: Pending, robots: Members) -> tuple[frozenset[Members], frozenset[Members]]:
    """A change without those who have left or are new: it goes on whoever comes and goes meanwhile."""
    before, after = (frozenset(group & robots for group in groups) for groups in (change.before, change.after))
    return before - {frozenset()}, after - {frozenset()}


def _standing(robots: Sequence[str], labels: Labels, waiting: Iterable[Pending] = ()) -> Standing:
    clusters = _groups(robots, labels, np.arange(len(robots)))
    return Standing(tuple(sorted(clusters, key=lambda members: min(members))), tuple(waiting))
