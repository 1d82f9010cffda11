"""What everyone but the station's own task reads: all that the station knows, frozen at one moment."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Literal

import numpy as np
from covista_schemas.reports import FoundBy, Status

from covista_service.grouping.similarity import Floats, closeness
from covista_service.perception.camera import Camera
from covista_service.perception.certainty import Interval
from covista_service.perception.comparison import Comparison
from covista_service.perception.visibility import SAME_SCALE
from covista_service.station.corrections import Correction
from covista_service.station.events import Keyframe, KeyframeId, Pair
from covista_service.station.ledger import Counts
from covista_service.station.options import NS_PER_S, GroupingOptions
from covista_service.station.outlook import Outlook, Ratios
from covista_service.station.pairs import Answer, Judged, PairRecord, apart, pair_of
from covista_service.station.roster import Fix, Robot
from covista_service.station.workload import Workload

Reason = Literal["no_pose", "gone"]


@dataclass(frozen=True, slots=True, eq=False)
class RobotView:
    """One robot; `camera` is that of its newest keyframe.

    `in_use` is the newest keyframe in use, `announced` the newest that came, usable or not. `judged` is by which it was
    judged whom its view may meet. Who is `present` has a token, and lives; `sign_of_life_ns` is the last one of others,
    in the station's time.
    """

    id: str
    status: Status
    group: str | None
    boot: str | None
    camera: Camera | None
    fix: Fix | None
    in_use: Keyframe | None
    announced: KeyframeId | None
    last_seen_ns: int | None
    clock_offset_s: float | None
    correction: Correction | None
    keyframes: Counts
    poses: Counts
    last_problem: str | None
    judged: Judged | None = None
    present: bool = False
    sign_of_life_ns: int = 0

    @property
    def keyframe(self) -> KeyframeId | None:
        """Name of the newest keyframe in use."""
        return None if self.in_use is None else self.in_use.id

    @classmethod
    def of(cls, robot: Robot, group: str | None, correction: Correction | None, judged: Judged | None) -> RobotView:
        """A robot as it is now, in this group."""
        offset_ns = robot.clock_offset_ns
        return cls(
            id=robot.id,
            status=robot.status or Status.LIVE,
            group=group,
            boot=robot.boot,
            camera=None if robot.arrived is None else robot.arrived.camera,
            fix=robot.fix,
            in_use=robot.keyframe or robot.remembered,
            announced=robot.announced,
            last_seen_ns=robot.last_seen_ns,
            clock_offset_s=None if offset_ns is None else offset_ns / NS_PER_S,
            correction=correction,
            keyframes=robot.ledgers["keyframe"].counts(),
            poses=robot.ledgers["pose"].counts(),
            last_problem=robot.last_problem,
            judged=judged,
            present=bool(robot.tokens),
            sign_of_life_ns=robot.sign_of_life_ns,
        )


@dataclass(frozen=True, slots=True, eq=False)
class PairView:
    """One pair, a < b. The keyframes are those that the overlaps were computed on.

    `compared` is what the last survey found, its first image being a's; planes that it can tell explain the overlaps
    if it is of the same keyframes (`explained`). `outlooks` are those of the keyframes, and `stands_for_ns` the sensor
    times of the poses that the overlaps stand for: later ones, for robots that have moved since.
    """

    a: str
    b: str
    overlap_a: float | None
    overlap_b: float | None
    found_by: FoundBy
    outcome: str
    compared: Comparison | None
    keyframe_a: Keyframe | None
    keyframe_b: Keyframe | None
    age_s: float | None
    explained: bool = False
    intervals: tuple[Interval, Interval] | None = None
    outlooks: tuple[Outlook, Outlook] | None = None
    ratios: Ratios = SAME_SCALE
    stands_for_ns: tuple[int, int] | None = None

    @property
    def apart(self) -> bool:
        """Whether they share nothing because their views cannot meet: nobody had to look for that."""
        return self.overlap_a == 0 and self.overlap_b == 0 and self.outlooks is None

    @property
    def inliers(self) -> int:
        """Matches that agreed with one geometry in the last survey."""
        return 0 if self.compared is None else int(self.compared.pose.inliers.sum())


@dataclass(frozen=True, slots=True, eq=False)
class SimilarityView:
    """The matrices (N, N) of the last evaluation in the order of `robots`; unknown overlaps are NaN.

    `sigma_m` is the range of Eq. 15. Overlaps are as last told; `mutual`, what two share, is smoothed. Distances and
    closeness are computed when somebody asks.
    """

    revision: int
    robots: tuple[str, ...]
    sigma_m: float
    similarity: Floats
    overlap: Floats
    squared_m2: Floats
    mutual: Floats

    @property
    def distance_m(self) -> Floats:
        """|r_i - r_j| (N, N) in metres."""
        return np.sqrt(self.squared_m2)

    @property
    def closeness(self) -> Floats:
        """d_ij of Eq. 15, (N, N)."""
        return closeness(self.distance_m, self.sigma_m)


@dataclass(frozen=True, slots=True)
class GroupView:
    """A group and its robots, sorted."""

    label: str
    robots: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class GroupsView:
    """The grouping in force since `time_ns`.

    As last evaluated: the scores of the numbers of groups, a note on settings that cannot be kept, and the robots of
    groups that others are proposed for and not shown yet (`waiting`). `last_label` is the highest number of a label
    that was ever used.
    """

    revision: int
    time_ns: int
    groups: tuple[GroupView, ...]
    ungrouped: tuple[tuple[str, Reason], ...]
    scores: tuple[tuple[int, float], ...]
    settings: GroupingOptions
    note: str | None = None
    waiting: tuple[str, ...] = ()
    last_label: int = 0
    by_label: Mapping[str, GroupView] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_label", {group.label: group for group in self.groups})


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """The station as of `now_ns` in its own time: ages and decay follow from that; clocks show `wall_ns`.

    There are records of the pairs whose views may meet. All others that have been judged share nothing.
    """

    now_ns: int
    robots: Mapping[str, RobotView]
    groups: GroupsView
    similarity: SimilarityView
    records: Mapping[Pair, PairRecord]
    decay_after_ns: int
    unknown_after_ns: int
    workload: Workload = field(default_factory=Workload)
    wall_ns: int = 0

    def group_of(self, robot: str) -> GroupView | None:
        """The group that a robot stands in."""
        view = self.robots.get(robot)
        return None if view is None or view.group is None else self.groups.by_label.get(view.group)

    def pair(self, a: str, b: str) -> PairView:
        """One pair of known robots in either order, seen from the smaller id; KeyError if a robot is not known."""
        a, b = pair_of(self.robots[a].id, self.robots[b].id)
        record = self.records.get((a, b)) or PairRecord(self._apart(a, b))
        answer = record.answer
        age_ns = 0 if answer is None else self.now_ns - answer.computed_ns
        if answer is None or age_ns >= self.unknown_after_ns:
            return PairView(a, b, None, None, FoundBy.UNKNOWN, record.outcome, record.compared, None, None, None)
        return PairView(
            a,
            b,
            *answer.overlaps,
            FoundBy.DECAYED if age_ns >= self.decay_after_ns else answer.found_by,
            record.outcome,
            record.compared,
            answer.first,
            answer.second,
            age_ns / NS_PER_S,
            record.explained,
            answer.intervals,
            answer.outlooks,
            answer.ratios,
            answer.stands_for_ns,
        )

    def _apart(self, a: str, b: str) -> Answer | None:
        first, second = self.robots[a].judged, self.robots[b].judged
        return None if first is None or second is None or a == b else apart(first, second)

    def pairs(self) -> Iterator[PairView]:
        """Every unordered pair of known robots once."""
        return (self.pair(a, b) for a, b in combinations(sorted(self.robots), 2))

    def recorded(self) -> Iterator[PairView]:
        """Those of them that there is a record of: no other share anything."""
        return (self.pair(a, b) for a, b in sorted(self.records))
