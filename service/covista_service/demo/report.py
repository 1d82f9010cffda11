"""What a demo run came to, as written by `--report`."""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(frozen=True, slots=True)
class Latency:
    """From a keyframe's arrival to the first groups that contain a survey of it; None if there were none."""

    p50: float | None
    p99: float | None


@dataclass(frozen=True, slots=True)
class Members:
    """A group."""

    label: str
    robots: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class DemoReport:
    """Counts of the whole run, mean errors of the overlap (`q_mae_seen`: where truth >= .1), the last groups."""

    robots: int
    keyframes_sent: int
    keyframes_received: int
    surveys: int
    q_mae: float | None
    q_mae_seen: float | None
    latency_ms: Latency
    groups: tuple[Members, ...]
    group_changes: int

    def as_json(self) -> dict[str, object]:
        """The report's fields."""
        return asdict(self)
