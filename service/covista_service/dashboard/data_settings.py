"""What the page asks for on which settings are tried."""

from __future__ import annotations

from functools import cache

from fastapi import APIRouter, Response
from pydantic_core import to_json

from covista_service.dashboard.choices import sections
from covista_service.dashboard.data import JSON

router = APIRouter(prefix="/data", include_in_schema=False)


@router.get("/choices")
async def choices() -> Response:
    """The settings that can be tried, in words."""
    return Response(_choices(), media_type=JSON)


@cache
def _choices() -> bytes:
    return to_json({"sections": sections()})
