"""What a page tells of two robots: numbers as REST has them, and sentences for people."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from covista_schemas.reports import FoundBy, PairSummary, Status

from covista_service.answers import brief_pair_report, find_pair, find_robot
from covista_service.dashboard.frames import silence_s
from covista_service.dashboard.robot_words import spoken
from covista_service.grouping.similarity import closeness
from covista_service.station.events import Keyframe
from covista_service.station.snapshot import PairView, RobotView, Snapshot

_HOW = {
    FoundBy.IMAGE: "Found in their images.",
    FoundBy.PREDICTED: "Predicted from what each of them has seen, and from where they stand now.",
    FoundBy.DECAYED: "From some time ago: nothing newer has been found since.",
    FoundBy.UNKNOWN: "Not known yet.",
}
_APART = "Their views cannot meet, so they have nothing in common."
# Why the last look at both images did not tell all; by the name of its outcome.
_OUTCOMES = {
    "not_surveyed": "Their images have not been compared.",
    "few_matches": "Too few points of one image are found again in the other.",
    "unverified": "Points match, but not so that one geometry explains them.",
    "no_parallax": "They look from too nearly the same place to tell how far things are.",
    "no_plane": "Points match, but lie on no plane that is large enough.",
    "kinds_differ": "They send features of different kinds, which cannot be compared.",
    "failed": "Comparing their images has failed.",
}


def pair_facts(snapshot: Snapshot, a: str, b: str) -> dict[str, Any]:
    """The pair in the order asked for, how near and alike the two are, and what to beware of. Raises NotKnownError."""
    pair, view = brief_pair_report(snapshot, a, b), find_pair(snapshot, a, b)
    robots, how = (find_robot(snapshot, a), find_robot(snapshot, b)), _how(view)
    return {
        **pair.model_dump(mode="json"),
        **_likeness(snapshot, a, b),
        "how": how,
        "matched": "" if how == _APART else _matched(pair),
        "why_not": None if how == _APART else _OUTCOMES.get(pair.outcome),
        "warnings": [*_presence(snapshot, robots), *_poses(pair, robots)],
        "robots": [_robot(snapshot, robot, view) for robot in robots],
    }


def _likeness(snapshot: Snapshot, a: str, b: str) -> dict[str, float | None]:
    """As of the last evaluation of the groups; None for who had told no pose then."""
    matrices = snapshot.similarity
    try:
        i, j = matrices.robots.index(a), matrices.robots.index(b)
    except ValueError:
        return {"distance_m": None, "similarity": None, "closeness": None}
    # One pair's own: the matrices of distance and closeness are computed whole for whoever asks for them.
    distance_m = matrices.squared_m2[i : i + 1, j : j + 1] ** 0.5
    return {
        "distance_m": float(distance_m[0, 0]),
        "similarity": float(matrices.similarity[i, j]),
        "closeness": float(closeness(distance_m, matrices.sigma_m)[0, 0]),
    }


def _how(view: PairView) -> str:
    return _APART if view.apart else _HOW[view.found_by]


def _matched(pair: PairSummary) -> str:
    """What the images had to say, of now or of when they were last compared: what is predicted is of other poses."""
    if not pair.inliers:
        return ""
    if pair.found_by is FoundBy.IMAGE:
        return f"{pair.inliers} matched points agree."
    return f"When their images were last compared, {pair.inliers} matched points agreed."


def _presence(snapshot: Snapshot, robots: tuple[RobotView, RobotView]) -> Iterator[str]:
    for robot in robots:
        if robot.status is Status.LIVE:
            continue
        silent_s = silence_s(robot, snapshot.wall_ns)
        since = "" if silent_s is None else f", silent for {spoken(silent_s)}"
        word = "is gone" if robot.status is Status.GONE else "is stale"
        yield f"{robot.id} {word}{since}: what is told of it is from before."


def _poses(pair: PairSummary, robots: tuple[RobotView, RobotView]) -> Iterator[str]:
    for robot in robots:
        off = robot.correction
        if off is not None and off.disagreeing:
            yield f"The pose that {robot.id} reports is {off.deg:.1f} deg and {off.m:.2f} m off what its images say."
    if pair.pose_source == "images":
        yield "Poses that their images say stand here for those that they report."


def _robot(snapshot: Snapshot, robot: RobotView, view: PairView) -> dict[str, Any]:
    keyframe = view.keyframe_a if view.a == robot.id else view.keyframe_b
    return {
        "id": robot.id,
        "status": robot.status,
        "group": robot.group,
        "silent_s": silence_s(robot, snapshot.wall_ns),
        "picture": None if keyframe is None else _picture(keyframe),
    }


def _picture(keyframe: Keyframe) -> str | None:
    """What there is to draw on."""
    if keyframe.image:
        return "image"
    if keyframe.thumbnail:
        return "thumbnail"
    return None if keyframe.features is None else "features"
