"""The station in numbers, for who asks often and needs no more: far cheaper than a snapshot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from covista_schemas.reports import Status

from covista_service.station.events import Topic
from covista_service.station.ledger import Counts
from covista_service.station.snapshot import Reason
from covista_service.station.workload import Workload


@dataclass(frozen=True, slots=True)
class Census:
    """Counts over all robots. Of `accounts`, but for what is missing and what waits, nothing ever falls.

    `clocks_off` robots have a clock that is off by more than ten seconds; `keyframes` have a keyframe in use; of
    `pairs` something is kept.
    """

    accounts: Mapping[Topic, Counts]
    robots: Mapping[Status, int]
    ungrouped: Mapping[Reason, int]
    clocks_off: int
    groups: int
    revision: int
    matrix_revision: int
    keyframes: int
    pairs: int
    workload: Workload
