"""A snapshot as what is to be remembered of it, for a station that starts after this one."""

from __future__ import annotations

from covista_service.station.events import Keyframe, Pair
from covista_service.station.memory import Memory, RememberedKeyframe, RememberedPair, RememberedRobot
from covista_service.station.pairs import PairRecord
from covista_service.station.snapshot import RobotView, Snapshot


def remember(snapshot: Snapshot) -> Memory:
    """All that `Station.restore` can take up again, but for the numbers of events, which the station does not know."""
    pairs = {pair: remember_pair(snapshot, pair, record) for pair, record in snapshot.records.items()}
    groups = snapshot.groups
    return Memory(
        robots=tuple(remember_robot(snapshot, view) for view in snapshot.robots.values()),
        pairs=tuple(pair for pair in pairs.values() if pair is not None),
        unknown=frozenset(pair for pair, known in pairs.items() if known is None),
        groups={group.label: frozenset(group.robots) for group in groups.groups},
        revision=groups.revision,
        label=groups.last_label,
    )


def remember_robot(snapshot: Snapshot, view: RobotView) -> RememberedRobot:
    """One robot; who has a token is alive to the last."""
    ahead_ns = _ahead_ns(snapshot)
    alive_ns = snapshot.now_ns if view.present else view.sign_of_life_ns
    return RememberedRobot(
        view.id,
        alive_ns - ahead_ns,
        view.boot,
        None if view.fix is None else view.fix.pose,
        0 if view.fix is None else view.fix.time_ns,
        None if view.in_use is None else _keyframe(view.in_use, ahead_ns),
        None if view.judged is None or view.in_use is None else view.judged.first_ns - ahead_ns,
    )


def remember_pair(snapshot: Snapshot, pair: Pair, record: PairRecord) -> RememberedPair | None:
    """One pair by its record; None while nothing is known of it."""
    answer = record.answer
    if answer is None or snapshot.now_ns - answer.computed_ns >= snapshot.unknown_after_ns:
        return None
    ahead_ns = _ahead_ns(snapshot)
    keyframes = (_keyframe(answer.first, ahead_ns), _keyframe(answer.second, ahead_ns))
    computed_ns = answer.computed_ns - ahead_ns
    return RememberedPair(pair, answer.overlaps, computed_ns, keyframes, answer.intervals, answer.times_ns)


def _ahead_ns(snapshot: Snapshot) -> int:
    """How far the station's time is ahead of the wall's, which is what another station knows."""
    return snapshot.now_ns - snapshot.wall_ns


def _keyframe(keyframe: Keyframe, ahead_ns: int) -> RememberedKeyframe:
    arrived_ns = keyframe.arrived_ns - ahead_ns
    return RememberedKeyframe(keyframe.id, keyframe.time_ns, arrived_ns, keyframe.camera, keyframe.pose)
