"""The groups in force: evaluated when the similarity has changed, told when they have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from covista_schemas.reports import EventKind

from covista_service.grouping.affinity import Affinity
from covista_service.grouping.bounds import Bounds
from covista_service.grouping.continuity import Change, Members, changes, follow
from covista_service.grouping.hysteresis import HysteresisOptions, Pending, Standing, weigh
from covista_service.grouping.k_means import Labels, dense
from covista_service.grouping.similarity import Floats
from covista_service.station.events import Effect, GroupsChanged, Happened, Pair
from covista_service.station.memory import Memory
from covista_service.station.options import GroupingOptions, StationOptions, nanoseconds
from covista_service.station.proposal import Proposal, propose
from covista_service.station.snapshot import GroupsView, GroupView, Reason, SimilarityView

# Keyframes that come together are evaluated together.
_APART_S = 0.02
# An evaluation looks at all pairs: in a large swarm the next one comes so much later for each robot.
_APART_PER_ROBOT_NS = 200_000
Ungrouped = tuple[tuple[str, Reason], ...]


class Groups:
    """Affinity of the robots that can be grouped, and the labelled groups that stand since `revision`."""

    def __init__(self, options: StationOptions) -> None:
        self._affinity = Affinity(options.grouping.smoothing)
        self._regroup_after_ns = nanoseconds(options.regroup_after_s)
        self._apart_ns = nanoseconds(min(options.regroup_after_s, _APART_S))
        self._members: dict[str, Members] = {}
        self._label_of: dict[str, str] = {}
        # Rows of the similarity that was evaluated last.
        self._rows: dict[str, int] = {}
        # Changes that settings propose and that are not shown yet.
        self._pending: tuple[Pending, ...] = ()
        # News of robots or settings is evaluated at once, drift of positions and overlaps a few times a second.
        self._news = self._drift = False
        # What new settings propose is shown at once.
        self._set_anew = False
        # A revision that nobody has been told of, though the groups are those of the station before.
        self._untold = False
        self._evaluated_ns = 0
        self.view = GroupsView(0, 0, (), (), (), options.grouping)
        self.similarity = SimilarityView(0, (), 1.0, *(_frozen(np.zeros((0, 0))) for _ in range(4)))

    def __contains__(self, robot: object) -> bool:
        return robot in self._affinity

    @property
    def robots(self) -> tuple[str, ...]:
        """Robots that take part, sorted."""
        return self._affinity.robots

    def label_of(self, robot: str) -> str | None:
        """Label of the group that a robot stands in."""
        return self._label_of.get(robot)

    def place(self, robot: str, position_m: Floats) -> None:
        """Set a robot's position; it takes part from now on."""
        if robot in self._affinity:
            self._affinity.move(robot, position_m)
            self._drift = True
        else:
            self._affinity.add(robot, position_m)
            self._news = True

    def withdraw(self, robot: str) -> None:
        """A robot takes part no longer."""
        if robot in self._affinity:
            self._affinity.remove(robot)
            self._news = True

    def see(
        self, pair: Pair, overlaps: tuple[float, float] | None, *, again: bool = False, moved: bool = False
    ) -> float | None:
        """Set a pair's overlaps, None where unknown; what they have in common since, smoothed.

        Nothing happens while one of the two takes no part. `again`: read anew from the same surfaces; `moved`: from
        those for other poses.
        """
        if pair[0] not in self._affinity or pair[1] not in self._affinity:
            return None
        self._drift = True
        return self._affinity.see(*pair, *(overlaps or (None, None)), again=again, moved=moved)

    def see_row(self, robot: str, others: Iterable[str], overlap: float | None) -> None:
        """Set the overlaps of a robot and many others to one number, those that take part."""
        known = [other for other in others if other in self._affinity]
        if robot in self._affinity and known:
            self._affinity.see_row(robot, known, np.full((len(known), 2), np.nan if overlap is None else overlap))
            self._drift = True

    def restore(self, memory: Memory, ungrouped: Ungrouped, wall_ns: int) -> None:
        """Take up groups of the station before, whose robots take part already, under a revision of their own.

        The first evaluation weighs what is known by then against them as if they had stood all the time.
        """
        groups = memory.groups
        self._members = dict(sorted(groups.items(), key=lambda group: min(group[1])))
        self._label_of = {robot: label for label in groups for robot in groups[label]}
        self._untold = memory.revision > 0 or bool(groups)
        self.view = replace(
            self.view,
            revision=memory.revision + self._untold,
            time_ns=wall_ns if self._untold else 0,
            groups=_views(self._members),
            ungrouped=ungrouped,
            last_label=memory.label,
        )

    def boundary(self, pair: Pair) -> float:
        """How near a pair is to the boundary of a group, from 0 to 1, as last evaluated.

        It is how alike two of different groups are, and how unlike two of the same.
        """
        first, second = (self._rows.get(robot) for robot in pair)
        if first is None or second is None:
            return 0.0
        alike = self.similarity.similarity.item(first, second)
        return 1.0 - alike if self._label_of.get(pair[0]) == self._label_of.get(pair[1]) else alike

    def set_options(self, options: GroupingOptions) -> None:
        """Group by other settings from the next evaluation on."""
        before = self.view.settings
        self.view = replace(self.view, settings=options)
        self._affinity.smoothing = options.smoothing
        self._news = True
        # How steady groups are does not say which groups there should be.
        self._set_anew |= replace(before, hysteresis=options.hysteresis, smoothing=options.smoothing) != options

    def may_evaluate(self, now_ns: int) -> bool:
        """Is the last evaluation over for long enough that news of a keyframe need not wait for that of others?"""
        return not 0 <= now_ns - self._evaluated_ns < self._spaced_ns(self._apart_ns)

    def _spaced_ns(self, least_ns: int) -> int:
        return max(least_ns, _APART_PER_ROBOT_NS * len(self._affinity)) if least_ns else 0

    def evaluate(self, ungrouped: Ungrouped, now_ns: int, wall_ns: int, *, at_once: bool) -> list[Effect]:
        """Bring similarity and groups up to date if there is news; a new revision only if someone stands elsewhere.

        `at_once` does not let drift wait. A new revision is of `wall_ns`, the time that others know.
        """
        # A clock that was set back must not make drift wait until it is where it was.
        recent = 0 <= now_ns - self._evaluated_ns < self._spaced_ns(self._regroup_after_ns)
        drifted = self._drift and (at_once or not recent)
        effects: list[Effect] = []
        if self._news or drifted or self._pending_is_due(now_ns):
            noted = self.view.note
            members = self._regroup(now_ns)
            if self.view.note is not None and (noted is None or self._set_anew):
                effects.append(Happened(EventKind.WARNING, now_ns, f"groups: {self.view.note}"))
            self._news = self._drift = self._set_anew = False
            self._evaluated_ns = now_ns
        elif self._untold or ungrouped != self.view.ungrouped:
            members = self._members
        else:
            return []
        if members != self._members or ungrouped != self.view.ungrouped:
            revision, groups = self.view.revision + 1, _views(members)
            self.view = replace(self.view, revision=revision, time_ns=wall_ns, groups=groups, ungrouped=ungrouped)
            effects += self._tell(members, now_ns)
        elif self._untold:
            # Nothing has happened, but robots and the history are to know by which number the groups stand now.
            effects.append(GroupsChanged(self.view.revision, tuple(sorted(self._label_of))))
        self._untold = False
        return effects

    def _pending_is_due(self, now_ns: int) -> bool:
        """Has the time of a change come since the last evaluation, or a clock been set back under it?"""
        after_ns = nanoseconds(self.view.settings.hysteresis.persistence_s)
        return any(
            now_ns < change.since_ns or self._evaluated_ns < change.since_ns + after_ns <= now_ns
            for change in self._pending
        )

    def _regroup(self, now_ns: int) -> dict[str, Members]:
        """Weigh the groups that are proposed now against those on show, and name what comes of it."""
        affinity, options = self._affinity, self.view.settings
        sigma_m = affinity.sigma_m(options.sigma)
        S = affinity.similarity(options.alpha, sigma_m)
        matrices = (_frozen(matrix) for matrix in (S, affinity.overlap, affinity.squared_m2, affinity.mutual))
        self.similarity = SimilarityView(self.similarity.revision + 1, affinity.robots, sigma_m, *matrices)
        self._rows = {robot: row for row, robot in enumerate(self.similarity.robots)}
        shown = None if self._set_anew else self._shown()
        proposal = propose(S, lambda alpha: affinity.similarity(alpha, sigma_m), options, shown)
        standing = self._weigh(proposal, now_ns)
        self._pending = standing.pending
        waiting = {robot for change in standing.pending for group in change.before for robot in group}
        following = follow(self._members, standing.clusters, self.view.last_label + 1)
        self.view = replace(
            self.view,
            scores=proposal.scores,
            note=proposal.note,
            waiting=tuple(sorted(waiting)),
            last_label=following.next_label - 1,
        )
        return following.groups

    def _shown(self) -> Labels:
        """The groups on show as labels (N,); newcomers stand alone."""
        rows = {label: row for row, label in enumerate(self._members)}
        labels = [rows.get(self._label_of.get(robot, ""), -1) for robot in self._affinity.robots]
        new = len(rows) + np.arange(len(labels))
        return dense(np.where(np.array(labels, np.intp) < 0, new, labels))

    def _weigh(self, proposal: Proposal, now_ns: int) -> Standing:
        robots, options = self._affinity.robots, self.view.settings.hysteresis
        at_once = HysteresisOptions(clear=0.0, persistence_s=0.0)
        arguments = (self._members, robots, proposal.labels, proposal.contributions, now_ns)
        if self._set_anew:
            return weigh(*arguments, at_once)
        standing = weigh(*arguments, options, self._pending)
        if _keeps(standing.clusters, proposal.bounds):
            return standing
        # Some changes of a proposal that keeps the bounds need not keep them without the others.
        still = weigh(*arguments, replace(options, clear=np.inf, persistence_s=np.inf), self._pending)
        return still if _keeps(still.clusters, proposal.bounds) else weigh(*arguments, at_once)

    def _tell(self, members: dict[str, Members], now_ns: int) -> list[Effect]:
        """What follows from a new revision."""
        before, self._members = self._members, members
        former, self._label_of = self._label_of, {robot: label for label in members for robot in members[label]}
        moved = [
            robot
            for robot in sorted(former.keys() | self._label_of.keys())
            if self._untold or _own(before, former.get(robot)) != _own(members, self._label_of.get(robot))
        ]
        revision = self.view.revision
        happened = [_happened(change, now_ns, revision) for change in changes(before, members)]
        everyone = tuple(sorted(self._label_of))
        whole = Happened(EventKind.GROUPS, now_ns, self._words(), everyone, tuple(members), revision - 1, revision)
        return [GroupsChanged(revision, tuple(moved)), whole, *happened]

    def _words(self) -> str:
        parts = [f"{group.label}: {', '.join(group.robots)}" for group in self.view.groups]
        parts += [f"{robot} {reason.replace('_', ' ')}" for robot, reason in self.view.ungrouped]
        return "; ".join(parts) or "no robots"


def _keeps(clusters: tuple[Members, ...], bounds: Bounds) -> bool:
    """Are groups as many and as large as they have to be?"""
    count = sum(map(len, clusters))
    return not count or (len(clusters) in bounds.numbers(count) and min(map(len, clusters)) >= bounds.min_group_size)


def _own(groups: dict[str, Members], label: str | None) -> tuple[str, Members] | None:
    return None if label is None else (label, groups[label])


def _happened(change: Change, now_ns: int, revision: int) -> Happened:
    robots, first, rest = ", ".join(change.robots), change.labels[0], ", ".join(change.labels[1:])
    text = {
        "join": f"{robots} joined {first}",
        "leave": f"{robots} left {first}",
        "split": f"{robots} split from {first} into {rest}",
        "merge": f"{rest} merged into {first}",
        "moved": f"{robots} moved from {first} to {rest}",
    }[change.kind]
    return Happened(EventKind(change.kind), now_ns, text, change.robots, change.labels, revision - 1, revision)


def _views(groups: Mapping[str, Members]) -> tuple[GroupView, ...]:
    return tuple(GroupView(label, tuple(sorted(robots))) for label, robots in groups.items())


def _frozen(matrix: Floats) -> Floats:
    """The same numbers, for others to read alone."""
    view = matrix.view()
    view.flags.writeable = False
    return view
