"""What other settings would make of the groups, computed from a snapshot; nothing changes by it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from covista_service.grouping import similarity as eqs
from covista_service.grouping.continuity import Members, follow
from covista_service.grouping.k_means import Labels
from covista_service.grouping.similarity import Floats, Sigma
from covista_service.station.options import GroupingOptions
from covista_service.station.proposal import propose
from covista_service.station.snapshot import GroupsView, GroupView, Snapshot


def preview(snapshot: Snapshot, options: GroupingOptions) -> GroupsView:
    """The groups that these settings would propose now if no groups stood, under the revision that is on show.

    As when other settings are given, nothing holds on to the groups on show, so those in force may propose others than
    hysteresis lets stand. Labels follow the groups on show; new ones have numbers
    that were never used. Raises ValueError for an alpha or a sigma that is none.
    """
    shown, view = snapshot.groups, snapshot.similarity
    # Compiled functions take arrays that may be written to; others hold these.
    squared_m2 = view.squared_m2.copy()
    mutual = eqs.mutual_overlap(view.overlap) if options.smoothing == 1 else view.mutual.copy()
    sigma_m = _sigma_m(squared_m2, mutual, options.sigma)

    def similarity(alpha: float) -> Floats:
        return eqs.similarity(mutual, squared_m2, alpha, sigma_m)

    proposal = propose(similarity(options.alpha), similarity, options)
    members = {group.label: frozenset(group.robots) for group in shown.groups}
    following = follow(members, _clusters(view.robots, proposal.labels), shown.last_label + 1)
    return replace(
        shown,
        groups=tuple(GroupView(label, tuple(sorted(robots))) for label, robots in following.groups.items()),
        scores=proposal.scores,
        settings=options,
        note=proposal.note,
        waiting=(),
    )


def _sigma_m(squared_m2: Floats, mutual: Floats, sigma: Sigma) -> float:
    if sigma == "shared":
        return eqs.shared_sigma_m(squared_m2, mutual)
    return eqs.standard_sigma_m(np.sqrt(squared_m2)) if sigma == "std" else eqs.check_sigma_m(sigma)


def _clusters(robots: Sequence[str], labels: Labels) -> list[Members]:
    members: defaultdict[int, set[str]] = defaultdict(set)
    for robot, label in zip(robots, labels.tolist(), strict=True):
        members[label].add(robot)
    return [frozenset(group) for group in members.values()]
