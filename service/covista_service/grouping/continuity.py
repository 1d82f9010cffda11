"""Labels that follow their groups over time, and what happened to groups between two moments."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import linear_sum_assignment

# Who shows groups by the numbers of their labels has few colours that all eyes tell apart: some seven.
COLOURS = 7

Members = frozenset[str]
Grouping = Mapping[str, Members]


@dataclass(frozen=True, slots=True)
class Following:
    """Groups by label, in the order of their first robots, and the number of the next new label."""

    groups: dict[str, Members]
    next_label: int


@dataclass(frozen=True, slots=True)
class Change:
    """Something that happened to groups; for split and merge the label that stays comes first.

    moved: `labels` are (from, to).
    """

    kind: Literal["join", "leave", "split", "merge", "moved"]
    robots: tuple[str, ...]
    labels: tuple[str, ...]


def follow(previous: Grouping, clusters: Iterable[Members], next_label: int) -> Following:
    """Name clusters so that as many robots as possible keep their label.

    A label goes to a cluster only with one of its robots. New labels are g1, g2, ... from `next_label`, never one
    that was used before. Numbers are left out so that up to COLOURS groups which are there together differ modulo
    COLOURS, and more of them are spread evenly, as far as groups that were there before allow.
    """
    ordered = sorted(clusters, key=lambda members: min(members))
    names = sorted(previous, key=_age)
    known = {members: label for label, members in previous.items()}
    if len(known) == len(ordered) and all(members in known for members in ordered):
        # Most of the time nothing has changed.
        return Following({known[members]: members for members in ordered}, next_label)
    inherited = _assign([previous[name] for name in names], ordered)
    groups: dict[str, Members] = {}
    worn = Counter(_number(names[row]) % COLOURS for row in inherited.values())
    for column, members in enumerate(ordered):
        if column in inherited:
            groups[names[inherited[column]]] = members
        else:
            number = min(range(next_label, next_label + COLOURS), key=lambda each: worn[each % COLOURS])
            worn[number % COLOURS] += 1
            groups[f"g{number}"] = members
            next_label = number + 1
    return Following(groups, next_label)


def changes(before: Grouping, after: Grouping) -> list[Change]:
    """What happened between two groupings, robots and labels in order."""
    old, new = _label_of(before), _label_of(after)
    found = [Change("leave", (robot,), (old[robot],)) for robot in sorted(old.keys() - new.keys())]
    flows: defaultdict[tuple[str, str], set[str]] = defaultdict(set)
    for robot in old.keys() & new.keys():
        flows[old[robot], new[robot]].add(robot)
    splits, merges = _splits(flows, before, after), _merges(flows, before, after)
    found += splits + merges
    told = {robot for change in splits + merges for robot in change.robots}
    for source, target in sorted(flows):
        if source != target:
            moved = sorted(flows[source, target] - told)
            found += [Change("moved", (robot,), (source, target)) for robot in moved]
    found += [Change("join", (robot,), (new[robot],)) for robot in sorted(new.keys() - old.keys())]
    return found


def _number(label: str) -> int:
    return int(label[1:])


def _age(label: str) -> tuple[int, str]:
    return len(label), label


def _assign(old: Sequence[Members], new: Sequence[Members]) -> dict[int, int]:
    """Column of `new` -> row of `old` that it shares most robots with, over all as one assignment."""
    if not old or not new:
        return {}
    row_of = {robot: row for row, members in enumerate(old) for robot in members}
    shared = np.zeros((len(old), len(new)))
    for column, members in enumerate(new):
        for row in (row_of[robot] for robot in members if robot in row_of):
            shared[row, column] += 1
    # Among equals the oldest label goes to the first cluster.
    order = np.add.outer(np.arange(len(old)), np.arange(len(new))) / (4 * (len(old) + len(new)) ** 2)
    rows, columns = linear_sum_assignment(shared - order, maximize=True)
    return {int(j): int(i) for i, j in zip(rows, columns, strict=True) if shared[i, j]}


def _label_of(grouping: Grouping) -> dict[str, str]:
    return {robot: label for label, members in grouping.items() for robot in members}


Flows = Mapping[tuple[str, str], set[str]]


def _splits(flows: Flows, before: Grouping, after: Grouping) -> list[Change]:
    """New labels whose robots, as far as they were grouped, all come from one group that goes on."""
    parts: defaultdict[str, list[str]] = defaultdict(list)
    for label in after.keys() - before.keys():
        sources = [source for source, target in flows if target == label]
        if len(sources) == 1 and sources[0] in after:
            parts[sources[0]].append(label)
    return [
        Change(
            "split",
            tuple(sorted(set().union(*(flows[source, label] for label in labels)))),
            (source, *sorted(labels, key=_age)),
        )
        for source, labels in sorted(parts.items())
    ]


def _merges(flows: Flows, before: Grouping, after: Grouping) -> list[Change]:
    """Labels that are no more and whose robots, as far as they are still grouped, all stand in one old group."""
    parts: defaultdict[str, list[str]] = defaultdict(list)
    for label in before.keys() - after.keys():
        targets = [target for source, target in flows if source == label]
        if len(targets) == 1 and targets[0] in before:
            parts[targets[0]].append(label)
    return [
        Change(
            "merge",
            tuple(sorted(set().union(*(flows[label, target] for label in labels)))),
            (target, *sorted(labels, key=_age)),
        )
        for target, labels in sorted(parts.items())
    ]
