"""Reports as tables for people."""

from __future__ import annotations

from datetime import datetime

from covista_schemas.reports import (
    GroupsReport,
    LiveSettings,
    PairsReport,
    RobotReport,
    RobotsReport,
    SimilarityReport,
)
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

NOTHING = "-"
# Scores of so many numbers of groups are shown, the best ones.
_BEST = 5


def robots(report: RobotsReport) -> RenderableType:
    """One line per robot."""
    table = table_of("robot", "status", "group", "position m", "received", "used", "dropped", "last problem")
    for robot in report.robots:
        position = NOTHING if robot.pose is None else " ".join(f"{value:.2f}" for value in robot.pose.position_m)
        received, used, dropped = _keyframes(robot)
        problem = escape(robot.last_problem or "")
        table.add_row(robot.id, robot.status.value, robot.group or NOTHING, position, received, used, dropped, problem)
    return table


def _keyframes(robot: RobotReport) -> tuple[str, str, str]:
    counters = robot.keyframes
    return str(counters.received), str(counters.used), str(sum(counters.dropped.values()))


def pairs(report: PairsReport) -> RenderableType:
    """One line per pair."""
    table = table_of("a", "b", "a seen by b", "b seen by a", "found by", "outcome", "inliers", "age s")
    for pair in report.pairs:
        shares = number(pair.overlap_a), number(pair.overlap_b)
        age = number(pair.age_s, digits=1)
        table.add_row(pair.a, pair.b, *shares, pair.found_by.value, escape(pair.outcome), str(pair.inliers), age)
    return table


def similarity(report: SimilarityReport) -> RenderableType:
    """The matrix, a row per robot."""
    table = table_of("", *report.robots)
    for robot, row in zip(report.robots, report.similarity, strict=True):
        table.add_row(robot, *(number(value) for value in row))
    return Group(table, f"revision {report.revision}")


def groups(report: GroupsReport) -> RenderableType:
    """One line per group, and what stands in none."""
    table = table_of("group", "robots")
    for group in report.groups:
        table.add_row(group.label, " ".join(group.robots))
    for alone in report.ungrouped:
        table.add_row(NOTHING, f"{alone.robot} ({alone.reason})")
    lines = [f"revision {report.revision} of {moment(report.time)} UTC, by {report.criterion}"]
    best = sorted(sorted(report.scores, key=lambda score: -score.score)[:_BEST], key=lambda score: score.groups)
    if best:
        lines.append(f"scores by number of groups: {', '.join(f'{each.groups}: {each.score:.3f}' for each in best)}")
        rest = len(report.scores) - len(best)
        lines[-1] += f", and {rest} lower" if rest else ""
    if report.waiting:
        lines.append(f"another grouping is proposed, and shown if it lasts, for {' '.join(report.waiting)}")
    if report.note is not None:
        lines.append(f"note: {escape(report.note)}")
    return Group(table, *lines)


def groups_line(report: GroupsReport) -> str:
    """The whole grouping in one line."""
    parts = [f"{group.label}: {' '.join(group.robots)}" for group in report.groups]
    parts += [f"{alone.robot} ({alone.reason})" for alone in report.ungrouped]
    return f"{report.time:%H:%M:%S} revision {report.revision}  {' | '.join(parts) or 'no robots'}"


def beside(in_force: GroupsReport, tried: GroupsReport) -> RenderableType:
    """The groups in force and those of a preview, a line per robot: who stands with whom."""
    now, then = _labels(in_force), _labels(tried)
    table = table_of("robot", "in force", "preview")
    for robot in sorted({*now, *then}, key=lambda robot: (now.get(robot, NOTHING), then.get(robot, NOTHING), robot)):
        table.add_row(robot, now.get(robot, NOTHING), then.get(robot, NOTHING))
    numbers = f"{len(in_force.groups)} groups by {in_force.criterion}, {len(tried.groups)} by {tried.criterion}"
    lines = [numbers] if tried.note is None else [numbers, f"note: {escape(tried.note)}"]
    return Group(table, *lines)


def settings(report: LiveSettings) -> RenderableType:
    """One line per setting, by the name that `covista settings set` takes."""
    table = table_of("setting", "value")
    for name, value in report.model_dump(mode="json").items():
        parts = value.items() if isinstance(value, dict) else ()
        for part, inner in parts:
            table.add_row(f"{name}.{part}", str(inner))
        if not parts:
            table.add_row(name, str(value))
    return table


def _labels(report: GroupsReport) -> dict[str, str]:
    return {robot: group.label for group in report.groups for robot in group.robots}


def moment(time: datetime) -> str:
    """A time for people, to the second."""
    return f"{time:%Y-%m-%d %H:%M:%S}"


def table_of(*headings: str) -> Table:
    """An empty table."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in headings:
        table.add_column(escape(heading), overflow="fold")
    return table


def number(value: float | None, digits: int = 2) -> str:
    """A number for people, or a dash."""
    return NOTHING if value is None else f"{value:.{digits}f}"
