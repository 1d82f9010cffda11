"""How the station is: for who restarts it, for who sends it work, and for Prometheus."""

from __future__ import annotations

from covista_schemas.reports import Health
from fastapi import APIRouter, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest

from covista_service.api import examples
from covista_service.api.access_metrics import of_access
from covista_service.api.deps import CensusNow, PartsNow, answer
from covista_service.api.metrics import of_station
from covista_service.api.outgoing_metrics import of_outgoing

router = APIRouter(tags=["health"])
_WORKING = ("ready", "degraded")
_RESPONSES = {**examples.show(examples.HEALTH), 503: {"model": Health, "description": "Starting or stopping"}}


@router.get("/healthz", response_model=Health, responses=_RESPONSES)
@router.get("/readyz", response_model=Health, responses=_RESPONSES)
async def health(parts: PartsNow) -> Response:
    """The station and its parts; degraded parts do not stop it."""
    found = parts.health()
    response = answer(found)
    response.status_code = 200 if found.status in _WORKING else 503
    return response


@router.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
def metrics(parts: PartsNow, census: CensusNow) -> Response:
    """Counts and latencies for Prometheus."""
    now = of_station(census, parts.vitals(), parts.health())
    text = generate_latest(parts.telemetry.registry) + generate_latest(now)
    text += generate_latest(of_outgoing(parts.outgoing, parts.stream))
    text += generate_latest(of_access(parts.gate))
    return Response(text, media_type=CONTENT_TYPE_LATEST)
