"""What was, and what happens now."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from typing import Annotated, TypeVar

import typer
from covista_schemas.reports import EventReport, EventsHistory, GroupsHistory, PairHistory, RobotTrack
from rich.console import RenderableType

from covista_clients.commands import past_tables
from covista_clients.commands.interrupting import ends_by_interrupt
from covista_clients.commands.options import (
    DEFAULT_URL,
    Authorities,
    Cursor,
    Format,
    Limit,
    Lines,
    Output,
    Since,
    Token,
    Until,
    Url,
    station,
)
from covista_clients.commands.showing import show
from covista_clients.mission_control import MissionControl

history = typer.Typer(no_args_is_help=True, help="Say what was: groups, events, a pair's overlap, a robot's track.")

_MOST = 100
_PAGE = 100
# What is passed over comes in pages as large as there are.
_LARGEST_PAGE = 1000
_RECENT = timedelta(hours=1)
_H = TypeVar("_H", GroupsHistory, EventsHistory, PairHistory, RobotTrack)


def events(
    since: Annotated[int | None, typer.Option(min=0, metavar="ID", help="Only events after this one.")] = None,
    follow: Annotated[bool, typer.Option("--follow", "-f", help="Go on with what happens, until Ctrl-C.")] = False,
    url: Url = DEFAULT_URL,
    token: Token = None,
    ca: Authorities = None,
    output: Lines = Format.TABLE,
) -> None:
    """Say what happened in the last hour, or since an event; with --follow what happens from now on, or since then."""
    with ends_by_interrupt(), station(url, token, ca) as control:
        for event in control.events(since) if follow else _past(control, since):
            print(event.model_dump_json() if output is Format.JSON else past_tables.event_line(event), flush=True)


@history.command("groups")
def groups_history(
    since: Since = None,
    until: Until = None,
    limit: Limit = _MOST,
    cursor: Cursor = None,
    url: Url = DEFAULT_URL,
    token: Token = None,
    ca: Authorities = None,
    output: Output = Format.TABLE,
) -> None:
    """Which groups there were."""
    with station(url, token, ca) as control:
        _show(control.groups_history, (since, until), limit, cursor, past_tables.groups, output)


@history.command("events")
def events_history(
    since: Since = None,
    until: Until = None,
    limit: Limit = _MOST,
    cursor: Cursor = None,
    kind: Annotated[list[str] | None, typer.Option(help="Only this kind; may be given more than once.")] = None,
    robot: Annotated[str | None, typer.Option(help="Only those of this robot.")] = None,
    url: Url = DEFAULT_URL,
    token: Token = None,
    ca: Authorities = None,
    output: Output = Format.TABLE,
) -> None:
    """What happened."""
    with station(url, token, ca) as control:
        asked = {"kind": kind or None, "robot": robot}
        _show(control.events_history, (since, until), limit, cursor, past_tables.events, output, **asked)


@history.command("pair")
def pair_history(
    a: str,
    b: str,
    since: Since = None,
    until: Until = None,
    limit: Limit = _MOST,
    cursor: Cursor = None,
    url: Url = DEFAULT_URL,
    token: Token = None,
    ca: Authorities = None,
    output: Output = Format.TABLE,
) -> None:
    """How much two robots saw in common."""
    with station(url, token, ca) as control:
        _show(control.pair_history, (a, b, since, until), limit, cursor, past_tables.pair, output)


@history.command("track")
def track(
    robot: str,
    since: Since = None,
    until: Until = None,
    limit: Limit = _MOST,
    cursor: Cursor = None,
    url: Url = DEFAULT_URL,
    token: Token = None,
    ca: Authorities = None,
    output: Output = Format.TABLE,
) -> None:
    """Where a robot was."""
    with station(url, token, ca) as control:
        _show(control.track, (robot, since, until), limit, cursor, past_tables.track, output)


def _past(control: MissionControl, after: int | None) -> Iterator[EventReport]:
    start = datetime.now(UTC) - _RECENT if after is None else None
    for page in control.pages(control.events_history, start, limit=_LARGEST_PAGE):
        yield from (event for event in page.items if after is None or event.id > after)


def _show(
    ask: Callable[..., _H],
    named: tuple[object, ...],
    limit: int,
    cursor: str | None,
    table: Callable[[_H], RenderableType],
    output: Format,
    **asked: object,
) -> None:
    """As many pages as it takes, as one."""
    page: _H = ask(*named, limit=min(limit, _PAGE), cursor=cursor, **asked)
    items, gaps = [*page.items], [*page.gaps]
    while page.next is not None and len(items) < limit:
        page = ask(*named, limit=min(limit - len(items), _PAGE), cursor=page.next, **asked)
        items += page.items
        gaps += [gap for gap in page.gaps if gap not in gaps]
    show(page.model_copy(update={"items": items, "gaps": gaps}), table, output)
