"""Why two robots are in one group or are not, in sentences for people."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from covista_schemas.reports import FoundBy

from covista_service.answers import find_robot
from covista_service.station.snapshot import PairView, RobotView, Snapshot

_MISSING = {"no_pose": "has told no pose yet, so it stands in no group", "gone": "is gone, so it stands in no group"}
_HOW = {
    FoundBy.IMAGE: "found in their images",
    FoundBy.PREDICTED: "predicted from what each of them has seen",
    FoundBy.DECAYED: "from some time ago",
}


def why(snapshot: Snapshot, a: str, b: str) -> list[str]:
    """Sentences, the answer first. Raises NotKnownError."""
    first, second = find_robot(snapshot, a), find_robot(snapshot, b)
    if a == b:
        return [f"{a} is one robot."]
    return [*_answer(snapshot, first, second), *_shared(snapshot.pair(a, b), a, b), *_others(snapshot, first, second)]


def _answer(snapshot: Snapshot, a: RobotView, b: RobotView) -> Iterator[str]:
    reasons = dict(snapshot.groups.ungrouped)
    alone = [view for view in (a, b) if view.group is None]
    for view in alone:
        yield f"{view.id} {_MISSING.get(reasons.get(view.id, ''), 'stands in no group yet')}."
    if alone:
        return
    if a.group == b.group:
        yield f"{a.id} and {b.id} are together in {a.group}."
    else:
        yield f"{a.id} is in {a.group} and {b.id} in {b.group}."


def _shared(pair: PairView, a: str, b: str) -> Iterator[str]:
    """What both see; a pair of a snapshot has its own order."""
    of_a, of_b = (pair.overlap_a, pair.overlap_b) if pair.a == a else (pair.overlap_b, pair.overlap_a)
    if of_a is None or of_b is None:
        yield "What both see is not known yet."
    elif pair.apart:
        yield "They see nothing in common: from where they stand their views cannot meet."
    elif max(of_a, of_b) == 0:
        yield f"They see nothing in common ({_HOW.get(pair.found_by, 'measured')})."
    else:
        how = _HOW.get(pair.found_by, "measured")
        yield f"{b} sees {100 * of_a:.0f} % of {a}'s view, {a} sees {100 * of_b:.0f} % of {b}'s ({how})."


def _others(snapshot: Snapshot, a: RobotView, b: RobotView) -> Iterator[str]:
    """How alike they are to their groups, by the similarity that groups are made by."""
    similarity = snapshot.similarity
    place = {name: k for k, name in enumerate(similarity.robots)}
    if a.group is None or b.group is None or a.id not in place or b.id not in place:
        return
    theirs = similarity.similarity[place[a.id], place[b.id]]
    yield f"Their similarity is {theirs:.2f}; groups are made so that similarity is high within and low between them."
    if a.group == b.group:
        return
    for one, group in ((a, b.group), (b, a.group)):
        yield _drawn_to(one, group, *(_mean(snapshot, place, one, each) for each in (one.group or "", group)))


def _drawn_to(robot: RobotView, group: str, own: float | None, theirs: float | None) -> str:
    like_them = f"{theirs or 0:.2f} to {group}"
    if own is None:
        return f"{robot.id} is alone in {robot.group}; its similarity is {like_them}."
    means = f"on average its similarity is {own:.2f} to its own group and {like_them}."
    if own > (theirs or 0):
        return f"{robot.id} belongs more to {robot.group}: {means}"
    return f"{robot.id} is now more like {group}, and moves there if that lasts: {means}"


def _mean(snapshot: Snapshot, place: dict[str, int], robot: RobotView, group: str) -> float | None:
    """The similarity of a robot to the others of a group; None where there are none."""
    members = [name for name in snapshot.groups.by_label[group].robots if name != robot.id and name in place]
    if not members:
        return None
    return float(np.mean([snapshot.similarity.similarity[place[robot.id], place[name]] for name in members]))
