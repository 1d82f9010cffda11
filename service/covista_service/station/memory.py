"""What a station that starts remembers of the one before it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from covista_service.perception.camera import Camera, Pose
from covista_service.perception.certainty import Interval
from covista_service.station.events import KeyframeId, Pair


@dataclass(frozen=True, slots=True, eq=False)
class RememberedKeyframe:
    """A keyframe without its features; `time_ns` is sensor time."""

    id: KeyframeId
    time_ns: int
    arrived_ns: int
    camera: Camera
    pose: Pose


@dataclass(frozen=True, slots=True, eq=False)
class RememberedRobot:
    """A robot as it was last: where it stood by sensor time `pose_time_ns`, and its newest keyframe in use.

    `last_seen_ns` is its last sign of life, a message or its token. `judged_ns` is when it was judged first whom its
    view may meet, None if it was not: of two that were, a pair that is neither remembered nor unknown shares nothing.
    """

    id: str
    last_seen_ns: int
    boot: str | None = None
    pose: Pose | None = None
    pose_time_ns: int = 0
    keyframe: RememberedKeyframe | None = None
    judged_ns: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class RememberedPair:
    """What two robots, the smaller id first, had in common, read at `computed_ns` from these two keyframes.

    Keyframes may be older than those in use; `times_ns` are the sensor times of the poses that it stands for.
    """

    pair: Pair
    overlaps: tuple[float, float]
    computed_ns: int
    keyframes: tuple[RememberedKeyframe, RememberedKeyframe]
    intervals: tuple[Interval, Interval] | None = None
    times_ns: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Memory:
    """All that is remembered, times in ns of the wall. Of `unknown` pairs there were records, and no answer.

    Numbers of the station before that may have been used up: the highest `revision` of the groups, the highest number
    of a `label` (g7 is 7) and of an `event`. None of them is used again.
    """

    robots: tuple[RememberedRobot, ...] = ()
    pairs: tuple[RememberedPair, ...] = ()
    unknown: frozenset[Pair] = frozenset()
    groups: Mapping[str, frozenset[str]] = field(default_factory=dict)
    revision: int = 0
    label: int = 0
    event: int = 0
