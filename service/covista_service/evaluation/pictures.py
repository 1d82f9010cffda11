"""A pair's survey drawn in both its pictures."""

from __future__ import annotations

import numpy as np

from covista_service.drawing import CommonField, Side, side_by_side
from covista_service.perception.camera import View
from covista_service.perception.survey import Survey
from covista_service.station.events import Keyframe, KeyframeId


def pair(views: tuple[View, View], images: tuple[bytes, bytes], found: Survey, captions: tuple[str, str]) -> bytes:
    """PNG of both encoded images side by side: planes in colour, matched points yellow, what is not common dimmed."""
    first, second = (_keyframe(view, image) for view, image in zip(views, images, strict=True))
    return side_by_side(
        Side(first, common_field(found, first=True), captions[0]),
        Side(second, common_field(found, first=False), captions[1]),
    )


def common_field(found: Survey, *, first: bool) -> CommonField:
    """What a survey found, in the first or the second image."""
    return CommonField(
        polygons_px=tuple(plane.region_first if first else plane.region_second for plane in found.planes),
        points_px=found.points_first_px if first else found.points_second_px,
        plane_of_point=tuple(np.asarray(found.plane_of_point).tolist()),
    )


def _keyframe(view: View, image: bytes) -> Keyframe:
    return Keyframe(KeyframeId("r", "b", 0), 0, 0, view.camera, view.pose, image)
