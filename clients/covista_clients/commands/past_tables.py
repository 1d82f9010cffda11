"""What was, as tables for people; times are UTC."""

from __future__ import annotations

from covista_schemas.reports import EventReport, EventsHistory, GroupsHistory, HistoryPage, PairHistory, RobotTrack
from rich.console import Group, RenderableType
from rich.markup import escape

from covista_clients.commands.tables import NOTHING, moment, number, table_of


def event_line(event: EventReport) -> str:
    """An event in one line."""
    who = f" (by {event.by})" if event.by else ""
    return f"{moment(event.time)}  {event.id:>6}  {event.event:<8}  {' '.join(event.text.split())}{who}"


def events(page: EventsHistory) -> RenderableType:
    """One line per event."""
    table = table_of("time", "id", "event", "what", "by")
    for event in page.items:
        table.add_row(moment(event.time), str(event.id), event.event.value, escape(event.text), event.by or NOTHING)
    return Group(table, *_below(page))


def groups(page: GroupsHistory) -> RenderableType:
    """One line per revision."""
    table = table_of("time", "revision", "groups")
    for report in page.items:
        told = [f"{group.label}: {' '.join(group.robots)}" for group in report.groups]
        told += [f"{alone.robot} ({alone.reason})" for alone in report.ungrouped]
        table.add_row(moment(report.time), str(report.revision), " | ".join(told) or "no robots")
    return Group(table, *_below(page))


def pair(page: PairHistory) -> RenderableType:
    """One line per moment at which the overlap became another."""
    table = table_of("time", f"{page.a} seen by {page.b}", f"{page.b} seen by {page.a}", "found by")
    for each in page.items:
        table.add_row(moment(each.time), number(each.overlap_a), number(each.overlap_b), each.found_by.value)
    return Group(table, *_below(page))


def track(page: RobotTrack) -> RenderableType:
    """One line per place."""
    table = table_of("time", "position m", "orientation xyzw")
    for point in page.items:
        place, turn = ((f"{value:.2f}" for value in part) for part in (point.position_m, point.orientation_xyzw))
        table.add_row(moment(point.time), " ".join(place), " ".join(turn))
    return Group(table, *_below(page))


def _below(page: HistoryPage) -> list[str]:
    """What is missing, and whether there is more."""
    lines = []
    for gap in page.gaps:
        lost = f"{gap.lost} entries" if gap.lost else "entries"
        lines.append(f"{lost} missing from {moment(gap.since)} to {moment(gap.until)}: {escape(gap.reason)}")
    if page.next is not None:
        lines.append(f"there is more: --limit, or what follows with --cursor {escape(page.next)}")
    return lines
