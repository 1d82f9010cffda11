"""The similarity matrix."""

from __future__ import annotations

from functools import partial

from covista_schemas.reports import SimilarityReport
from fastapi import APIRouter, Request, Response

from covista_service import answers
from covista_service.api import examples
from covista_service.api.delivery import Delivery
from covista_service.api.deps import JSON, PartsNow, is_known, tagged

router = APIRouter(prefix="/similarity", tags=["similarity"])


@router.get("", response_model=SimilarityReport, responses={**examples.show(examples.SIMILARITY), **examples.UNCHANGED})
async def similarity(request: Request, parts: PartsNow) -> Response:
    """Similarity (Eq. 16), overlap (row i: share of i's image that j sees), closeness (Eq. 15), distance."""

    def tag() -> str:
        return f"similarity {parts.name} {parts.loop.snapshot().similarity.revision}"

    if is_known(request, tag()):
        return tagged(Response(status_code=304), tag())
    body = await parts.outgoing.share(
        "similarity", tag, lambda: partial(answers.similarity_json, parts.loop.snapshot())
    )
    return tagged(Delivery(body, parts.outgoing, JSON), body.tag)
