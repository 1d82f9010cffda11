"""Where robots were and what pairs had in common over time: of a snapshot a second, what is news."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from covista_schemas.reports import FoundBy

from covista_service.answers.robots import quaternion_of
from covista_service.perception.camera import Pose
from covista_service.station.events import Pair
from covista_service.station.pairs import PairRecord
from covista_service.station.roster import Fix
from covista_service.station.snapshot import Snapshot
from covista_service.store.rows import PairEntry, TrackEntry

NOTHING = (0.0, 0.0)
_Read = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Thinning:
    """What is news: a robot that has gone so far or turned so much, an overlap that has changed by so much.

    What was read anew is told again after `again_s`, however little has changed.
    """

    moved_m: float = 0.1
    turned_deg: float = 5.0
    overlap: float = 0.05
    again_s: float = 60.0


@dataclass(frozen=True, slots=True)
class _Moment:
    """What was told of a pair last: overlaps, None for unknown, and when they were read for poses of which times."""

    time_us: int
    overlaps: tuple[float, float] | None
    read: _Read | None


class Sampler:
    """Compares snapshots with what was told before. What is frozen and the very same is not looked at again."""

    def __init__(self, thinning: Thinning | None = None) -> None:
        self._thinning = thinning or Thinning()
        self._again_us = round(self._thinning.again_s * 1e6)
        self._turned_cos = float(np.cos(np.radians(self._thinning.turned_deg)))
        self._fixes: dict[str, Fix] = {}
        self._points: dict[str, tuple[int, Pose]] = {}
        self._records: dict[Pair, PairRecord] = {}
        self._moments: dict[Pair, _Moment] = {}

    def look(self, snapshot: Snapshot) -> list[TrackEntry | PairEntry]:
        """What is news."""
        time_us = snapshot.wall_ns // 1000
        return [*self._tracks(snapshot, time_us), *self._pairs(snapshot, time_us), *self._parted(snapshot, time_us)]

    def _tracks(self, snapshot: Snapshot, time_us: int) -> Iterator[TrackEntry]:
        for robot, view in snapshot.robots.items():
            fix = view.fix
            if fix is None or self._fixes.get(robot) is fix:
                continue
            self._fixes[robot] = fix
            if self._has_moved(robot, fix.pose, time_us):
                self._points[robot] = (time_us, fix.pose)
                yield TrackEntry(robot, time_us, pose_of(fix.pose))
        for robot in [robot for robot in self._fixes if robot not in snapshot.robots]:
            del self._fixes[robot]
            self._points.pop(robot, None)

    def _has_moved(self, robot: str, pose: Pose, time_us: int) -> bool:
        if robot not in self._points:
            return True
        before_us, before = self._points[robot]
        # 2 cos + 1 of the angle between two rotations is the trace of R' R.
        cos = (float(np.vdot(before.world_from_camera, pose.world_from_camera)) - 1) / 2
        gone = pose.centre_m - before.centre_m
        far = float(gone @ gone) > self._thinning.moved_m**2
        return far or cos < self._turned_cos or abs(time_us - before_us) >= self._again_us

    def _pairs(self, snapshot: Snapshot, time_us: int) -> Iterator[PairEntry]:
        known = self._records
        for pair, record in snapshot.records.items():
            if known.get(pair) is record:
                continue
            known[pair] = record
            overlaps = None if record.answer is None else record.answer.overlaps
            if self._is_news(pair, record, overlaps, time_us):
                yield self._tell(snapshot, pair, record, time_us)

    def _is_news(self, pair: Pair, record: PairRecord, now: tuple[float, float] | None, time_us: int) -> bool:
        told = self._moments.get(pair)
        if told is None or told.overlaps is None or now is None:
            before = None if told is None else told.overlaps
            # Who never had anything in common, and still has not, is no news.
            return now != before and not (told is None and now == NOTHING)
        before = told.overlaps
        if max(abs(now[0] - before[0]), abs(now[1] - before[1])) > self._thinning.overlap:
            return True
        return told.read != _read(record) and now != NOTHING and abs(time_us - told.time_us) >= self._again_us

    def _parted(self, snapshot: Snapshot, time_us: int) -> Iterator[PairEntry]:
        """Pairs that no record is kept of any more: their views cannot meet, or one of the robots is forgotten."""
        records = snapshot.records
        for pair in [pair for pair in self._records if pair not in records]:
            del self._records[pair]
            told = self._moments.pop(pair, None)
            if told is not None and told.overlaps is not None:
                entry = self._tell(snapshot, pair, None, time_us)
                if entry.overlap_a is None and not all(robot in snapshot.robots for robot in pair):
                    del self._moments[pair]
                if (entry.overlap_a, entry.overlap_b) != told.overlaps:
                    yield entry
        yield from self._forgotten(snapshot, time_us)

    def _forgotten(self, snapshot: Snapshot, time_us: int) -> Iterator[PairEntry]:
        """Pairs that had parted before one of the robots was forgotten: nothing is known of them any more."""
        robots = snapshot.robots
        for a, b in [(a, b) for a, b in self._moments if a not in robots or b not in robots]:
            if self._moments.pop((a, b)).overlaps is not None:
                yield PairEntry(a, b, time_us, None, None, FoundBy.UNKNOWN)

    def _tell(self, snapshot: Snapshot, pair: Pair, record: PairRecord | None, time_us: int) -> PairEntry:
        a, b = pair
        if a not in snapshot.robots or b not in snapshot.robots:
            self._moments[pair] = _Moment(time_us, None, None)
            return PairEntry(a, b, time_us, None, None, FoundBy.UNKNOWN)
        view = snapshot.pair(a, b)
        known = view.overlap_a is not None and view.overlap_b is not None
        overlaps = (float(view.overlap_a or 0), float(view.overlap_b or 0)) if known else None
        self._moments[pair] = _Moment(time_us, overlaps, _read(record))
        return PairEntry(a, b, time_us, view.overlap_a, view.overlap_b, view.found_by)


def _read(record: PairRecord | None) -> _Read | None:
    answer = None if record is None else record.answer
    return None if answer is None else (answer.computed_ns, *answer.stands_for_ns)


def pose_of(pose: Pose) -> tuple[float, ...]:
    """Position and orientation, as the tables have them."""
    return (*(float(value) for value in pose.centre_m), *quaternion_of(pose.world_from_camera))
