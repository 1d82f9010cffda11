"""How the station is doing: its log, its counts, and how long a keyframe takes to show in the groups."""

from __future__ import annotations

from covista_service.telemetry.counts import WORKER_FAILED, JobKind, Stage, Summary, Telemetry
from covista_service.telemetry.logs import LogFormat, about, log_to_stderr

__all__ = ["WORKER_FAILED", "JobKind", "LogFormat", "Stage", "Summary", "Telemetry", "about", "log_to_stderr"]
