"""Groups, similarity and events as reports."""

from __future__ import annotations

import numpy as np
from covista_schemas import reports

from covista_service.answers.settings import live_settings
from covista_service.answers.unknown import NotKnownError
from covista_service.station.events import Happened
from covista_service.station.snapshot import Snapshot


def similarity_report(snapshot: Snapshot) -> reports.SimilarityReport:
    """The matrices. They are ours and checked by construction, so a million numbers are not checked again."""
    view = snapshot.similarity
    known = view.overlap.astype(object)
    known[np.isnan(view.overlap)] = None
    return reports.SimilarityReport.model_construct(
        revision=view.revision,
        robots=list(view.robots),
        similarity=view.similarity.tolist(),
        overlap=known.tolist(),
        closeness=view.closeness.tolist(),
        distance_m=view.distance_m.tolist(),
    )


def groups_report(snapshot: Snapshot) -> reports.GroupsReport:
    """The groups in force."""
    view = snapshot.groups
    return reports.GroupsReport(
        revision=view.revision,
        time=reports.time_of(view.time_ns or snapshot.wall_ns),
        groups=[reports.Group(label=group.label, robots=list(group.robots)) for group in view.groups],
        ungrouped=[reports.Ungrouped(robot=robot, reason=reason) for robot, reason in view.ungrouped],
        criterion="components" if view.settings.grouping == "components" else view.settings.criterion,
        scores=[reports.Score(groups=groups, score=score) for groups, score in view.scores],
        note=view.note,
        waiting=list(view.waiting),
        settings=live_settings(view.settings),
    )


def group_report(snapshot: Snapshot, label: str) -> reports.Group:
    """One group. Raises NotKnownError."""
    for group in snapshot.groups.groups:
        if group.label == label:
            return reports.Group(label=group.label, robots=list(group.robots))
    raise NotKnownError("Unknown group", f"no group {label[:80]!r} stands")


def own_group_report(snapshot: Snapshot, robot: str) -> reports.OwnGroupReport:
    """What a robot is told of its group."""
    group = snapshot.group_of(robot)
    return reports.OwnGroupReport(
        robot=robot,
        label=group.label if group else None,
        robots=list(group.robots) if group else [],
        revision=snapshot.groups.revision,
        time=reports.time_of(snapshot.groups.time_ns),
    )


def event_report(number: int, happened: Happened) -> reports.EventReport:
    """Something that happened, under a number of its own."""
    return reports.EventReport(
        id=number,
        event=happened.kind,
        time=reports.time_of(happened.time_ns),
        robots=list(happened.robots),
        labels=list(happened.labels),
        revision_before=happened.revision_before,
        revision_after=happened.revision_after,
        by=happened.by,
        text=happened.text,
    )
