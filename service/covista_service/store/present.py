"""Keeps the last state of robots and pairs in the database, for a station that starts: writes what has changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import islice

from sqlalchemy import Connection, Table, delete

from covista_service.answers.robots import camera_message
from covista_service.perception.camera import Pose
from covista_service.station.events import Keyframe, KeyframeId, Pair
from covista_service.station.pairs import Answer, PairRecord
from covista_service.station.snapshot import RobotView, Snapshot
from covista_service.store.sampler import pose_of
from covista_service.store.tables import POSE, keyframes_now, pairs_now, robots_now
from covista_service.store.upserts import Row, remove, upsert

# An overlap that has changed by less since it was written is written with the next keyframe.
_CHANGED = 0.01
# So many pairs are written at a time; of a thousand robots more may change in a second, and wait for the next.
_MOST_PAIRS = 1000
# Keyframes that nothing names any more are looked for after so many writes.
_SWEEP = 30
# Who has a token and sends nothing is written so often.
_ALIVE_NS = 5_000_000_000
_TABLES = (keyframes_now, robots_now, pairs_now)
_NO_POSE = dict.fromkeys(POSE)


@dataclass(slots=True)
class _Changes:
    """Rows to write and keys to remove, of one table each."""

    rows: dict[Table, list[Row]] = field(default_factory=lambda: {table: [] for table in _TABLES})
    gone: dict[Table, list[tuple[object, ...]]] = field(default_factory=lambda: {table: [] for table in _TABLES})


@dataclass(frozen=True, slots=True)
class _Written:
    """What was written of an answer: whoever kept the answer itself would keep images and surfaces too."""

    overlaps: tuple[float, float]
    computed_ns: int
    keyframes: tuple[KeyframeId, KeyframeId]

    @classmethod
    def of(cls, answer: Answer) -> _Written:
        return cls(answer.overlaps, answer.computed_ns, answer.keyframes)


class Present:
    """What the database knows of the present; not for several threads at once.

    After a write that failed, `forget`: everything is written anew.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Nothing is known of what the database holds."""
        self._fresh = True
        self._writes = 0
        self._robots: dict[str, tuple[RobotView, int]] = {}
        self._pairs: dict[Pair, _Written | None] = {}
        self._records: Mapping[Pair, PairRecord] = {}
        self._waiting: dict[Pair, None] = {}
        self._keyframes: set[KeyframeId] = set()

    def write(self, connection: Connection, snapshot: Snapshot) -> None:
        """Bring the tables to a snapshot, in the connection's transaction. If that fails in any way, `forget`."""
        if self._fresh:
            for table in _TABLES:
                connection.execute(delete(table))
        self._fresh = False
        changes = _Changes()
        self._change_robots(snapshot, changes)
        self._change_pairs(snapshot, changes)
        self._writes += 1
        if self._writes % _SWEEP == 0:
            self._sweep(changes)
        for table in _TABLES:
            upsert(connection, table, changes.rows[table])
            remove(connection, table, changes.gone[table])

    def _change_robots(self, snapshot: Snapshot, changes: _Changes) -> None:
        for name, view in snapshot.robots.items():
            held, written_ns = self._robots.get(name, (None, 0))
            if held is view and not (view.present and snapshot.now_ns - written_ns >= _ALIVE_NS):
                continue
            self._robots[name] = (view, snapshot.now_ns)
            changes.rows[robots_now].append(self._robot(view, snapshot, changes))
        for name in [name for name in self._robots if name not in snapshot.robots]:
            del self._robots[name]
            changes.gone[robots_now].append((name,))

    def _change_pairs(self, snapshot: Snapshot, changes: _Changes) -> None:
        pairs, waiting, seen = self._pairs, self._waiting, self._records
        for pair, record in snapshot.records.items():
            if seen.get(pair) is not record and not (pair in pairs and _hardly_other(pairs[pair], record.answer)):
                waiting[pair] = None
        self._records = snapshot.records
        # Who has waited longest comes first, with what is known of it now.
        for pair in list(islice(waiting, _MOST_PAIRS)):
            del waiting[pair]
            if pair in snapshot.records:
                answer = snapshot.records[pair].answer
                pairs[pair] = None if answer is None else _Written.of(answer)
                changes.rows[pairs_now].append(self._pair(pair, answer, snapshot, changes))
        for pair in [pair for pair in pairs if pair not in snapshot.records]:
            del pairs[pair]
            changes.gone[pairs_now].append(pair)

    def _sweep(self, changes: _Changes) -> None:
        """Keyframes are named by the rows that stand: those of the answers written last, and of robots."""
        named = {name for written in self._pairs.values() if written is not None for name in written.keyframes}
        named |= {view.in_use.id for view, _ in self._robots.values() if view.in_use is not None}
        for name in self._keyframes - named:
            changes.gone[keyframes_now].append((name.robot, name.boot, name.sequence))
        self._keyframes &= named

    def _robot(self, view: RobotView, snapshot: Snapshot, changes: _Changes) -> Row:
        ahead_ns = snapshot.now_ns - snapshot.wall_ns
        alive_ns = snapshot.now_ns if view.present else view.sign_of_life_ns
        fix, keyframe, judged = view.fix, view.in_use, view.judged
        if keyframe is not None:
            self._name(keyframe, ahead_ns, changes)
        return {
            "robot": view.id,
            "last_seen_ns": alive_ns - ahead_ns,
            "boot": view.boot,
            "pose_time_ns": None if fix is None else fix.time_ns,
            **(_NO_POSE if fix is None else _pose(fix.pose)),
            "keyframe_boot": None if keyframe is None else keyframe.id.boot,
            "keyframe_sequence": None if keyframe is None else keyframe.id.sequence,
            "judged_ns": None if judged is None else judged.first_ns - ahead_ns,
        }

    def _pair(self, pair: Pair, answer: Answer | None, snapshot: Snapshot, changes: _Changes) -> Row:
        if answer is None:
            return dict.fromkeys(pairs_now.c.keys()) | dict(zip("ab", pair, strict=True))
        ahead_ns = snapshot.now_ns - snapshot.wall_ns
        for keyframe in (answer.first, answer.second):
            self._name(keyframe, ahead_ns, changes)
        (low_a, high_a), (low_b, high_b) = answer.intervals or ((None, None), (None, None))
        time_a_ns, time_b_ns = answer.times_ns or (None, None)
        return {
            "a": pair[0],
            "b": pair[1],
            "computed_ns": answer.computed_ns - ahead_ns,
            "overlap_a": float(answer.overlaps[0]),
            "overlap_b": float(answer.overlaps[1]),
            "low_a": low_a,
            "high_a": high_a,
            "low_b": low_b,
            "high_b": high_b,
            "boot_a": answer.first.id.boot,
            "sequence_a": answer.first.id.sequence,
            "boot_b": answer.second.id.boot,
            "sequence_b": answer.second.id.sequence,
            "pose_time_a_ns": time_a_ns,
            "pose_time_b_ns": time_b_ns,
        }

    def _name(self, keyframe: Keyframe, ahead_ns: int, changes: _Changes) -> None:
        """See to it that a keyframe which a row names is there."""
        name = keyframe.id
        if name in self._keyframes:
            return
        self._keyframes.add(name)
        changes.rows[keyframes_now].append(
            {
                "robot": name.robot,
                "boot": name.boot,
                "sequence": name.sequence,
                "time_ns": keyframe.time_ns,
                "arrived_ns": keyframe.arrived_ns - ahead_ns,
                "camera": camera_message(keyframe.camera).model_dump_json(),
                **_pose(keyframe.pose),
            }
        )


def _pose(pose: Pose) -> Row:
    return dict(zip(POSE, pose_of(pose), strict=True))


def _hardly_other(written: _Written | None, answer: Answer | None) -> bool:
    """Would a station that starts not tell the difference?"""
    if written is None or answer is None:
        return written is None and answer is None
    before, now = written.overlaps, answer.overlaps
    return (
        abs(now[0] - before[0]) <= _CHANGED
        and abs(now[1] - before[1]) <= _CHANGED
        and written.computed_ns == answer.computed_ns
        and written.keyframes[0] is answer.first.id
        and written.keyframes[1] is answer.second.id
    )
