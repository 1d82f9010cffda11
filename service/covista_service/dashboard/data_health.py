"""What the page asks for that tells how the station is."""

from __future__ import annotations

from collections.abc import Iterator

from fastapi import APIRouter, Response
from prometheus_client import CollectorRegistry, ProcessCollector
from pydantic_core import to_json

from covista_service.dashboard.checkup import Checkup, Timings
from covista_service.dashboard.data import JSON
from covista_service.dashboard.health_words import told
from covista_service.dashboard.opening import open_pages
from covista_service.dashboard.places import MOST_PAGES
from covista_service.dashboard.sources import Sources, SourcesNow

_LATENCY, _TURN = "covista_keyframe_to_groups_seconds", "covista_turn_seconds_sum"
_FAULTS, _MEMORY = "covista_faults_total", "process_resident_memory_bytes"
_READ = (f"{_LATENCY}_sum", f"{_LATENCY}_count", f"{_LATENCY}_bucket", _TURN, _FAULTS)
_process = ProcessCollector(registry=None)

router = APIRouter(prefix="/data", include_in_schema=False)


@router.get("/health")
async def health(sources: SourcesNow) -> Response:
    """How the station is."""
    return Response(sources.rounds.told(lambda: _look(sources)), media_type=JSON)


def _look(sources: Sources) -> bytes:
    snapshot = sources.loop.snapshot()
    checkup = Checkup(
        health=sources.health(),
        vitals=sources.vitals(),
        census=sources.loop.census(),
        robots=list(snapshot.robots.values()),
        summary=sources.rounds.summary(sources.telemetry.summary),
        timings=timings_of(sources.telemetry.registry),
        refused=sources.gate.refused,
        given_up=sources.given_up(),
        listeners=sources.listeners(),
        pages=open_pages(),
        most_pages=MOST_PAGES,
    )
    return to_json({"station": sources.name, **told(checkup)})


def timings_of(registry: CollectorRegistry) -> Timings:
    """What was measured, of all that Prometheus is told."""
    read = dict(_samples(registry))
    return Timings(
        latency_sum_s=read.get((f"{_LATENCY}_sum", ""), 0.0),
        latencies=int(read.get((f"{_LATENCY}_count", ""), 0)),
        within_half_s=int(read.get((f"{_LATENCY}_bucket", "0.5"), 0)),
        turns_s=read.get((_TURN, ""), 0.0),
        memory_bytes=read.get((_MEMORY, "")),
        faults={where: int(value) for (name, where), value in read.items() if name == _FAULTS},
    )


def _samples(registry: CollectorRegistry) -> Iterator[tuple[tuple[str, str], float]]:
    # What a process is like is told of no registry by name.
    for family in (*registry.restricted_registry(_READ).collect(), *_process.collect()):
        for sample in family.samples:
            yield (sample.name, next(iter(sample.labels.values()), "")), sample.value
