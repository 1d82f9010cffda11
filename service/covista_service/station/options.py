"""Options of the station: times of presence and of answers, room for surveys, and how robots are grouped."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from covista_service.grouping.bounds import Groups
from covista_service.grouping.hysteresis import HysteresisOptions
from covista_service.grouping.selection import Criterion
from covista_service.grouping.similarity import Sigma

NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class GroupingOptions:
    """The settings that may change while the station runs: Eqs. 15 to 17, and how steady groups are.

    Groups are made from the similarity (`spectral`), of what similarities above a threshold link (`components`), or
    from closeness alone (`distance`). `smoothing` is the weight of a pair's newest overlap.
    """

    alpha: float = 0.5
    groups: Groups = "auto"
    min_group_size: int = 1
    sigma: Sigma = "shared"
    criterion: Criterion = "adaptive"
    grouping: Literal["spectral", "components", "distance"] = "spectral"
    hysteresis: HysteresisOptions = field(default_factory=HysteresisOptions)
    smoothing: float = 0.3


@dataclass(frozen=True, slots=True)
class StationOptions:
    """`capacity` is how many surveys, and how many extractions, may be under way at once.

    A robot is stale when silent for `live_after_s`, gone after `gone_after_s` more, forgotten `forget_after_s` after
    its last sign of life. An answer about a pair is decayed, then unknown, so long after it was computed. A pair
    whose views cannot meet, as far as known, is tried all the same once in a while, and no sooner than after
    `retry_after_s`: see `Patrol`. A new keyframe's first survey regroups within 20 ms; other surveys and poses do at
    most every `regroup_after_s`; both come later in swarms of more than 100 and 500 robots, by .2 ms a robot.
    Of robots that have moved, no more than `forecasts_per_s` ordered pairs are read anew from known surfaces; with 0
    none are.
    """

    capacity: int = 2
    live_after_s: float = 5.0
    gone_after_s: float = 30.0
    forget_after_s: float = 600.0
    decay_after_s: float = 60.0
    unknown_after_s: float = 600.0
    retry_after_s: float = 30.0
    regroup_after_s: float = 0.1
    forecasts_per_s: float = 4000.0
    grouping: GroupingOptions = GroupingOptions()


def nanoseconds(seconds: float) -> int:
    """Seconds as whole nanoseconds."""
    return round(seconds * NS_PER_S)
