"""Groups of robots."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from covista_schemas.reports import Group, GroupsHistory, GroupsReport
from fastapi import APIRouter, Path, Query, Request, Response

from covista_service import answers
from covista_service.answers import NotKnownError
from covista_service.answers.past import PAGE, Archive
from covista_service.api import examples
from covista_service.api.deps import JSON, PartsNow, SnapshotNow, answer, answer_unless_known
from covista_service.api.errors import describe
from covista_service.api.past import (
    PROBLEMS,
    FromQuery,
    HistoryCursor,
    Moment,
    PageQuery,
    UntilQuery,
    read_past,
    span_ns,
    time_ns,
)
from covista_service.api.settings import BODY_PROBLEMS, PatchBody, options_with
from covista_service.station.preview import preview as propose_groups

router = APIRouter(prefix="/groups", tags=["groups"])
TimeQuery = Annotated[Moment, Query(description="A moment (RFC 3339).", examples=["2026-05-04T12:30:15Z"])]
LabelPath = Annotated[str, Path(description="Label of a group.", examples=["g1"])]


@router.get("", response_model=GroupsReport, responses={**examples.show(examples.GROUPS), **examples.UNCHANGED})
async def groups(request: Request, parts: PartsNow, snapshot: SnapshotNow) -> Response:
    """Who belongs together, and why so many groups."""
    # Scores move without a new revision, so the content itself is what tells versions apart.
    content = parts.texts.groups(snapshot)
    return answer_unless_known(request, content, lambda: Response(content, media_type=JSON))


@router.get("/history", response_model=GroupsHistory, responses={**examples.show(examples.GROUPS_HISTORY), **PROBLEMS})
async def history(
    parts: PartsNow,
    since: FromQuery = None,
    until: UntilQuery = None,
    cursor: HistoryCursor = None,
    limit: PageQuery = PAGE,
) -> Response:
    """Revisions of the groups, the oldest first; the first may be of groups that stood before `from` no longer."""
    span = span_ns(since, until)
    return await read_past(parts, lambda archive: archive.groups(*span, cursor, limit))


@router.get("/at", response_model=GroupsReport, responses={**examples.show(examples.GROUPS), **describe(404, 503)})
async def at(parts: PartsNow, time: TimeQuery) -> Response:
    """The groups that were in force at a time; 404 if none were, or they are not kept any more."""

    def find(archive: Archive) -> GroupsReport:
        found = archive.groups_at(time_ns(time))
        if found is None:
            raise NotKnownError("No groups then", "no groups of that time are kept")
        return found

    return await read_past(parts, find)


@router.post("/preview", response_model=GroupsReport, responses={**examples.show(examples.GROUPS), **BODY_PROBLEMS})
async def preview(patch: PatchBody, parts: PartsNow, snapshot: SnapshotNow) -> Response:
    """The groups that other settings would make of the swarm as it is now. Nothing is changed.

    What is left out of the body is as in the settings in force, which the answer's `settings` were made from. Groups
    that stand keep their labels. Settings that so many robots cannot keep are loosened, and `note` says so.
    """
    options = options_with(snapshot, patch)
    view = await parts.previews.run(lambda: propose_groups(snapshot, options))
    return answer(answers.groups_report(replace(snapshot, groups=view)), parts.outgoing)


@router.get("/{label}", response_model=Group, responses={**examples.show(examples.GROUP), **describe(404)})
def group(label: LabelPath, snapshot: SnapshotNow) -> Response:
    """One group."""
    return answer(answers.group_report(snapshot, label))
