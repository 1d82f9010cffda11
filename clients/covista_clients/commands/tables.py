"""Reports as tables for people."""

from __future__ import annotations

from covista_schemas.reports import GroupsReport, PairsReport, RobotReport, RobotsReport, SimilarityReport
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

_NOTHING = "-"
# Scores of so many numbers of groups are shown, the best ones.
_BEST = 5


def robots(report: RobotsReport) -> RenderableType:
    """One line per robot."""
    table = _table("robot", "status", "group", "position m", "received", "used", "dropped", "last problem")
    for robot in report.robots:
        position = _NOTHING if robot.pose is None else " ".join(f"{value:.2f}" for value in robot.pose.position_m)
        received, used, dropped = _keyframes(robot)
        problem = escape(robot.last_problem or "")
        table.add_row(robot.id, robot.status.value, robot.group or _NOTHING, position, received, used, dropped, problem)
    return table


def _keyframes(robot: RobotReport) -> tuple[str, str, str]:
    counters = robot.keyframes
    return str(counters.received), str(counters.used), str(sum(counters.dropped.values()))


def pairs(report: PairsReport) -> RenderableType:
    """One line per pair."""
    table = _table("a", "b", "a seen by b", "b seen by a", "found by", "outcome", "inliers", "age s")
    for pair in report.pairs:
        shares = _number(pair.overlap_a), _number(pair.overlap_b)
        age = _number(pair.age_s, digits=1)
        table.add_row(pair.a, pair.b, *shares, pair.found_by.value, escape(pair.outcome), str(pair.inliers), age)
    return table


def similarity(report: SimilarityReport) -> RenderableType:
    """The matrix, a row per robot."""
    table = _table("", *report.robots)
    for robot, row in zip(report.robots, report.similarity, strict=True):
        table.add_row(robot, *(_number(value) for value in row))
    return Group(table, f"revision {report.revision}")


def groups(report: GroupsReport) -> RenderableType:
    """One line per group, and what stands in none."""
    table = _table("group", "robots")
    for group in report.groups:
        table.add_row(group.label, " ".join(group.robots))
    for alone in report.ungrouped:
        table.add_row(_NOTHING, f"{alone.robot} ({alone.reason})")
    lines = [f"revision {report.revision} of {report.time:%Y-%m-%d %H:%M:%S} UTC, by {report.criterion}"]
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


def _table(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in headings:
        table.add_column(escape(heading), overflow="fold")
    return table


def _number(value: float | None, digits: int = 2) -> str:
    return _NOTHING if value is None else f"{value:.{digits}f}"
