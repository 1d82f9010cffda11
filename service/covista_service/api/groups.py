"""Groups of robots."""

from __future__ import annotations

from typing import Annotated

from covista_schemas.reports import Group, GroupsReport
from fastapi import APIRouter, Path, Request, Response

from covista_service import answers
from covista_service.api import examples
from covista_service.api.deps import SnapshotNow, answer, answer_unless_known
from covista_service.api.errors import describe

router = APIRouter(prefix="/groups", tags=["groups"])
LabelPath = Annotated[str, Path(description="Label of a group.", examples=["g1"])]


@router.get("", response_model=GroupsReport, responses={**examples.show(examples.GROUPS), **examples.UNCHANGED})
def groups(request: Request, snapshot: SnapshotNow) -> Response:
    """Who belongs together, and why so many groups."""
    report = answers.groups_report(snapshot)
    # Scores move without a new revision.
    return answer_unless_known(request, report.model_dump_json(), lambda: answer(report))


@router.get("/{label}", response_model=Group, responses={**examples.show(examples.GROUP), **describe(404)})
def group(label: LabelPath, snapshot: SnapshotNow) -> Response:
    """One group."""
    return answer(answers.group_report(snapshot, label))
