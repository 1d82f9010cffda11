"""The similarity matrix."""

from __future__ import annotations

from covista_schemas.reports import SimilarityReport
from fastapi import APIRouter, Request, Response

from covista_service import answers
from covista_service.api import examples
from covista_service.api.deps import PartsNow, SnapshotNow, answer, answer_unless_known

router = APIRouter(prefix="/similarity", tags=["similarity"])


@router.get("", response_model=SimilarityReport, responses={**examples.show(examples.SIMILARITY), **examples.UNCHANGED})
def similarity(request: Request, parts: PartsNow, snapshot: SnapshotNow) -> Response:
    """Similarity (Eq. 16), overlap (row i: share of i's image that j sees), closeness (Eq. 15), distance."""
    tag = f"similarity {parts.name} {snapshot.similarity.revision}"
    return answer_unless_known(request, tag, lambda: answer(answers.similarity_report(snapshot)))
