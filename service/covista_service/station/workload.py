"""How much the station has to do, and how much it has done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Workload:
    """What waits now and what was done since the start; `waiting` pairs and `started` surveys are by queue.

    `waiting` counts robots in the queues fresh (with partners) and moved, and pairs in regular, where most fresh ones
    stand too.
    `outdated` surveys were given up before they began, since a keyframe of theirs had been replaced. `forecasts` are
    ordered pairs whose overlap was read anew for a new pose, `forecasts_waiting` robots whose new pose waits for that.
    """

    waiting: Mapping[str, int] = field(default_factory=dict)
    started: Mapping[str, int] = field(default_factory=dict)
    under_way: int = 0
    outdated: int = 0
    forecasts: int = 0
    forecasts_waiting: int = 0
