"""The similarity matrix."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Annotated, Any

from covista_schemas.reports import SimilarityReport
from fastapi import APIRouter, Query, Request, Response

from covista_service import answers
from covista_service.answers import Matrix
from covista_service.api import examples
from covista_service.api.delivery import Delivery
from covista_service.api.deps import JSON, PartsNow, is_known, tagged
from covista_service.api.errors import describe
from covista_service.api.negotiation import choose
from covista_service.api.outgoing import Piece
from covista_service.station.snapshot import Snapshot

router = APIRouter(prefix="/similarity", tags=["similarity"])
NPY, CSV = "application/x-npy", "text/csv"

MatrixQuery = Annotated[
    Matrix, Query(description="Which matrix, where the answer holds one: as NumPy's file or as a table of text.")
]
_FILES: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The matrices as JSON, or one of them as a file.",
        "content": {
            JSON: {"example": examples.SIMILARITY.model_dump(mode="json")},
            NPY: {
                "schema": {
                    "type": "string",
                    "format": "binary",
                    "description": "Two arrays one after the other, as np.save writes them to one file: the matrix "
                    "(N, N) of float64, NaN where unknown, and the ids of the robots (N,) as bytes.",
                }
            },
            CSV: {
                "schema": {
                    "type": "string",
                    "description": "First row and first column: ids of robots. Empty where unknown.",
                },
                "example": "robot,r1,r2\r\nr1,1.0,0.71\r\nr2,0.71,1.0\r\n",
            },
        },
    }
}


@router.get("", response_model=SimilarityReport, responses={**_FILES, **examples.UNCHANGED, **describe(406, 503)})
async def similarity(request: Request, parts: PartsNow, matrix: MatrixQuery = "similarity") -> Response:
    """Similarity (Eq. 16), overlap (row i: share of i's image that j sees), closeness (Eq. 15), distance.

    `Accept` says as what: `application/json` holds all four and does not heed `matrix`; `application/x-npy` and
    `text/csv` hold one of them with the robots that its rows and columns are of. Each has an ETag of its own.
    """
    media_type = choose(request.headers.get("accept"), (JSON, NPY, CSV))
    kind = f"similarity {media_type}" if media_type == JSON else f"similarity {media_type} {matrix}"

    def tag() -> str:
        return f"{kind} {parts.name} {parts.loop.snapshot().similarity.revision}"

    def make() -> Callable[[], Iterable[Piece]]:
        return partial(_pieces, parts.loop.snapshot(), media_type, matrix)

    if is_known(request, tag()):
        return tagged(Response(status_code=304), tag())
    body = await parts.outgoing.share(kind, tag, make)
    return tagged(Delivery(body, parts.outgoing, media_type), body.tag)


def _pieces(snapshot: Snapshot, media_type: str, matrix: Matrix) -> Iterable[Piece]:
    match media_type:
        case "application/x-npy":
            return answers.matrix_npy(snapshot, matrix)
        case "text/csv":
            return answers.matrix_csv(snapshot, matrix)
        case _:
            return answers.similarity_json(snapshot)
