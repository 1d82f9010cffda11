"""The one task that owns the station: draws events from a source, sends jobs to workers and news to sinks."""

from __future__ import annotations

from covista_service.loop.parties import (
    Built,
    Crew,
    CrewStatus,
    Extraction,
    News,
    Sink,
    SinkStatus,
    Source,
)
from covista_service.loop.task import TICK_S, Loop

__all__ = [
    "TICK_S",
    "Built",
    "Crew",
    "CrewStatus",
    "Extraction",
    "Loop",
    "News",
    "Sink",
    "SinkStatus",
    "Source",
]
