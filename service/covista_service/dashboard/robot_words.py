"""One robot in words for people: how it is, what its clock and its pose are like, why messages of it are dropped."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from covista_schemas.reports import Status

from covista_service.dashboard.frames import silence_s
from covista_service.dashboard.reasons import DROPPED, UNTOLD
from covista_service.station.corrections import Correction
from covista_service.station.events import Keyframe
from covista_service.station.ledger import Counts
from covista_service.station.options import NS_PER_S
from covista_service.station.pairs import pair_of
from covista_service.station.snapshot import RobotView, Snapshot

_UNGROUPED = {"no_pose": "It has told no pose yet, so it stands in no group.", "gone": "So it stands in no group."}
# A clock that is off by less is well set, as far as one can tell from messages that take some time.
_CLOCK_S = 0.25


def standing(snapshot: Snapshot, view: RobotView) -> list[str]:
    """How it is, and with whom: sentences."""
    told = [_presence(view, snapshot.wall_ns)]
    if view.group is not None:
        others = [name for name in snapshot.groups.by_label[view.group].robots if name != view.id]
        told.append(f"It stands in {view.group}, " + (f"with {listed(others)}." if others else "alone."))
    else:
        reason = dict(snapshot.groups.ungrouped).get(view.id, "")
        told.append(_UNGROUPED.get(reason, "It stands in no group yet."))
    if view.group is not None and view.id in snapshot.groups.waiting:
        told.append("Another group is proposed for it; it moves there if that lasts.")
    return told


def _presence(view: RobotView, wall_ns: int) -> str:
    silent = "" if view.last_seen_ns is None else spoken(max(0.0, (wall_ns - view.last_seen_ns) / NS_PER_S))
    match view.status:
        case Status.LIVE:
            return f"{view.id} is live" + (f"; it was heard {silent} ago." if silent else ".")
        case Status.STALE:
            return f"{view.id} is stale: nothing came from it for {silent or 'a while'}."
        case _:
            return f"{view.id} is gone: nothing came from it for {silent or 'long'}. What is shown is the last of it."


def silent_beside(snapshot: Snapshot, view: RobotView) -> dict[str, dict[str, Any]]:
    """Those that are not live, of the robots that may share its view: how they are, and for how long silent."""
    return {
        other.id: {"status": other.status, "silent_s": silence_s(other, snapshot.wall_ns)}
        for other in snapshot.robots.values()
        if other.status is not Status.LIVE and pair_of(view.id, other.id) in snapshot.records
    }


def clock(offset_s: float | None) -> str:
    """What its clock is like beside the station's."""
    if offset_s is None:
        return "Nothing is known of its clock yet."
    if abs(offset_s) < _CLOCK_S:
        return f"Its clock goes with the station's, within {1000 * _CLOCK_S:.0f} ms."
    way = "ahead of" if offset_s > 0 else "behind"
    why = "" if offset_s > 0 else ", or its messages take as long"
    return f"Its clock is {spoken(abs(offset_s))} {way} the station's{why}. That does no harm here: ages go by arrival."


def pose(view: RobotView) -> str:
    """How far its poses may be trusted, as far as images tell."""
    if view.fix is None:
        return "It has told no pose yet."
    if view.correction is None:
        return "Whether its pose is right cannot be told: no other robot's images have been compared with its own yet."
    return _agreement(view.correction)


def _agreement(correction: Correction) -> str:
    if not correction.disagreeing:
        return "Its pose is right, as far as its images and those of others tell."
    often = "" if correction.disagreeing == 1 else f", {correction.disagreeing} keyframes in a row"
    return f"By the images its pose is off by {correction.deg:.1f} degrees and {correction.m:.2f} m{often}."


def dropped(view: RobotView) -> list[dict[str, Any]]:
    """What was dropped and why, the most first."""
    found = [*_dropped("keyframes", view.keyframes), *_dropped("poses", view.poses)]
    return sorted(found, key=lambda each: (-each["count"], each["of"], each["reason"]))


def _dropped(kind: str, counts: Counts) -> Iterator[dict[str, Any]]:
    for reason, count in counts.dropped.items():
        yield {"of": kind, "reason": reason, "count": count, "meaning": DROPPED.get(reason, UNTOLD).means}


def picture(keyframe: Keyframe | None) -> dict[str, Any]:
    """What there is to see of its newest keyframe: `key` changes with it, and is None where there is no picture."""
    if keyframe is None:
        return {"key": None, "words": "It has sent no keyframe that the station could use, so there is no picture."}
    if keyframe.features is None and keyframe.image is None and keyframe.thumbnail is None:
        return {"key": None, "words": "It has sent no keyframe since this station started, so there is no picture yet."}
    words = "Its newest keyframe."
    if keyframe.image is None:
        sent = "a thumbnail" if keyframe.thumbnail else "keypoints alone"
        words = f"Its newest keyframe, of which it sends {sent}."
    return {"key": f"{keyframe.id.boot}.{keyframe.id.sequence}", "words": words}


def listed(names: list[str], most: int = 8) -> str:
    """Names in a sentence."""
    if len(names) > most:
        return f"{', '.join(names[: most - 1])} and {len(names) - most + 1} more"
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def spoken(seconds: float) -> str:
    """A time as one says it."""
    if seconds < 10:
        return f"{seconds:.1f} s"
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
