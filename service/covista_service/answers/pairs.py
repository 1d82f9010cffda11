"""Pairs of robots as reports, and the survey that explains one."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Literal

import numpy as np
from covista_schemas import reports

from covista_service.answers.robots import find_robot, keyframe_id
from covista_service.answers.unknown import NotKnownError
from covista_service.perception.camera import Camera, Floats, Pose
from covista_service.perception.comparison import Comparison
from covista_service.perception.regions import RegionOptions, regions
from covista_service.perception.survey import Outcome, Plane, Survey, SurveyOptions, explain
from covista_service.station.events import Keyframe
from covista_service.station.outlook import masks
from covista_service.station.snapshot import PairView, Snapshot

# Hundredths of a pixel are finer than any camera's model.
_DECIMALS_PX = 2


def pairs_report(snapshot: Snapshot, robot: str | None = None, min_overlap: float | None = None) -> reports.PairsReport:
    """All pairs, or those of one robot, or those where one sees at least this share of the other's image."""
    summaries = pair_summaries(snapshot, robot, min_overlap)
    return reports.PairsReport(pairs=[summary for summary in summaries if summary is not None])


def pair_summaries(
    snapshot: Snapshot, robot: str | None = None, min_overlap: float | None = None
) -> Iterator[reports.PairSummary | None]:
    """What `pairs_report` lists, one by one: of a thousand robots they are half a million. Raises NotKnownError.

    None for each pair that was looked at and is not listed.
    """
    least = min_overlap or 0.0
    views = snapshot.recorded() if least > 0 else snapshot.pairs()
    if robot is not None:
        find_robot(snapshot, robot)
        views = (snapshot.pair(robot, other) for other in snapshot.robots if other != robot)
    for view in views:
        yield pair_summary(view, least)


def pair_summary(view: PairView, least: float = 0.0) -> reports.PairSummary | None:
    """A pair of a snapshot; None if neither sees this share of the other's image."""
    listed = max(view.overlap_a or 0.0, view.overlap_b or 0.0) >= least
    return reports.PairSummary.model_validate(_pair(view, "a")) if listed else None


def brief_pair_report(snapshot: Snapshot, a: str, b: str) -> reports.PairSummary:
    """A pair in the order asked for, without planes and regions, which take time. Raises NotKnownError."""
    view = find_pair(snapshot, a, b)
    return reports.PairSummary.model_validate(_pair(view, "a" if view.a == a else "b"))


def find_pair(snapshot: Snapshot, a: str, b: str) -> PairView:
    """A pair of two robots, in the station's order. Raises NotKnownError."""
    find_robot(snapshot, a)
    find_robot(snapshot, b)
    if a == b:
        raise NotKnownError("Unknown pair", f"{a!r} makes no pair with itself")
    return snapshot.pair(a, b)


def pair_report(snapshot: Snapshot, a: str, b: str) -> reports.PairReport:
    """A pair in the order asked for. Raises NotKnownError."""
    return pair_view_report(find_pair(snapshot, a, b), a)


def pair_view_report(view: PairView, a: str) -> reports.PairReport:
    """A pair of a snapshot with robot `a`, one of the two, as the first."""
    first: Literal["a", "b"] = "a" if view.a == a else "b"
    planes, regions = _planes(view), common_regions(view)
    if first == "b":
        planes = [
            plane.model_copy(update={"polygon_a": plane.polygon_b, "polygon_b": plane.polygon_a}) for plane in planes
        ]
        regions = regions[::-1]
    return reports.PairReport(
        **_pair(view, first),
        regions_a=[_polygon(region) for region in regions[0]],
        regions_b=[_polygon(region) for region in regions[1]],
        planes=planes,
    )


def explaining_survey(view: PairView) -> Survey | None:
    """The planes of a pair, as far as images of the keyframes that its overlaps were read from tell them."""
    if not view.explained or view.compared is None or view.keyframe_a is None or view.keyframe_b is None:
        return None
    found = _explained(view.keyframe_a.camera, view.keyframe_b.camera, view.compared)
    return found if found.outcome is Outcome.MEASURED else None


@lru_cache(maxsize=64)
def _explained(first: Camera, second: Camera, compared: Comparison) -> Survey:
    """Clustering planes takes some milliseconds: done when somebody asks, and kept for who asks again."""
    return explain(first, second, compared, SurveyOptions())


def common_regions(view: PairView) -> tuple[list[Floats], list[Floats]]:
    """The common field in a's image and in b's: polygons (k, 2) in px, by the surfaces that the overlaps come from."""
    if view.outlooks is None:
        return [], []
    seen = masks(*view.outlooks, view.ratios)
    cameras = [outlook.keyframe.camera for outlook in view.outlooks]
    in_a, in_b = (
        [np.array(region) for region in regions(mask, camera, RegionOptions())]
        for mask, camera in zip(seen, cameras, strict=True)
    )
    return in_a, in_b


def _pair(view: PairView, first: Literal["a", "b"]) -> dict[str, object]:
    """The fields of a summary, with the robot that is to come first as `a`."""
    sure_a, sure_b = view.intervals or (None, None)
    time_a, time_b = view.stands_for_ns or (None, None)
    sides = [
        (view.a, view.overlap_a, sure_a, view.keyframe_a, time_a),
        (view.b, view.overlap_b, sure_b, view.keyframe_b, time_b),
    ]
    one, other = sides if first == "a" else sides[::-1]
    (a, overlap_a, interval_a, keyframe_a, time_a), (b, overlap_b, interval_b, keyframe_b, time_b) = one, other
    return {
        "a": a,
        "b": b,
        "overlap_a": overlap_a,
        "overlap_b": overlap_b,
        "interval_a": interval_a,
        "interval_b": interval_b,
        "found_by": view.found_by,
        "outcome": view.outcome,
        "inliers": view.inliers,
        "pose_source": _pose_source(view),
        "age_s": view.age_s,
        "keyframes": _keyframes(keyframe_a, keyframe_b),
        "poses": _times(time_a, time_b),
    }


def _pose_source(view: PairView) -> Literal["reported", "images"] | None:
    if view.found_by is reports.FoundBy.UNKNOWN:
        return None
    corrected = view.outlooks is not None and any(one.pose is not one.keyframe.pose for one in view.outlooks)
    return "images" if corrected else "reported"


def _keyframes(a: Keyframe | None, b: Keyframe | None) -> reports.PairKeyframes | None:
    return reports.PairKeyframes(a=keyframe_id(a.id), b=keyframe_id(b.id)) if a and b else None


def _times(a_ns: int | None, b_ns: int | None) -> reports.PairTimes | None:
    if a_ns is None or b_ns is None:
        return None
    return reports.PairTimes(a=reports.time_of(a_ns), b=reports.time_of(b_ns))


def _planes(view: PairView) -> list[reports.PlaneReport]:
    survey = explaining_survey(view)
    if survey is None or view.keyframe_a is None:
        return []
    return [_plane(plane, view.keyframe_a.pose) for plane in survey.planes]


def _plane(plane: Plane, pose: Pose) -> reports.PlaneReport:
    """A plane in the world frame.

    u . X + 1 = 0 with X = R' (X_world - c) of the first camera is (R u) . X_world + 1 - (R u) . c = 0.
    """
    turned = pose.world_from_camera @ plane.normal
    length = float(np.linalg.norm(turned))
    x, y, z = (float(value) for value in turned / length)
    return reports.PlaneReport(
        normal=(x, y, z),
        offset_m=(1.0 - float(turned @ pose.centre_m)) / length,
        support=plane.support,
        polygon_a=_polygon(plane.region_first),
        polygon_b=_polygon(plane.region_second),
    )


def _polygon(points_px: Floats) -> reports.Polygon:
    return [(x, y) for x, y in np.round(points_px, _DECIMALS_PX).tolist()]
