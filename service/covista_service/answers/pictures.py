"""What two robots have in common as a picture."""

from __future__ import annotations

from covista_service.answers.pairs import common_regions, explaining_survey
from covista_service.answers.unknown import NotKnownError
from covista_service.drawing import CommonField, overlay
from covista_service.station.snapshot import PairView


def pair_picture(view: PairView, drawn: str) -> bytes:
    """PNG of the keyframe of `drawn`, one of the two, with the common field in it. Raises NotKnownError."""
    first = drawn == view.a
    other = view.b if first else view.a
    keyframe = view.keyframe_a if first else view.keyframe_b
    if keyframe is None:
        raise NotKnownError("No picture", f"what {drawn!r} and {other!r} have in common is not known yet")
    if keyframe.features is None:
        raise NotKnownError("No picture", f"{drawn!r} has sent no keyframe since this station started")
    share = view.overlap_a if first else view.overlap_b
    words = "unknown" if share is None else f"{share:.0%}"
    caption = (
        f"{drawn} #{keyframe.id.sequence}: {words} of it seen by {other} ({view.found_by}, {view.inliers} inliers)"
    )
    return overlay(keyframe, _common_field(view, first=first), caption)


def _common_field(view: PairView, *, first: bool) -> CommonField | None:
    regions = tuple(common_regions(view)[0 if first else 1])
    survey = explaining_survey(view)
    if survey is None:
        # Views that cannot meet have nothing in common, and that is known.
        return None if view.overlap_a is None else CommonField(regions)
    return CommonField(
        regions,
        tuple(plane.region_first if first else plane.region_second for plane in survey.planes),
        survey.points_first_px if first else survey.points_second_px,
        tuple(survey.plane_of_point.tolist()),
    )
