"""The common field of view drawn in a keyframe, as the paper's Figs. 2 to 4 show it.

What the other camera does not see is dimmed, planes are tinted, matched points are yellow.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from covista_service.drawing import canvas
from covista_service.drawing.canvas import Picture
from covista_service.perception.camera import Camera, Floats, undistort
from covista_service.station.events import Keyframe

# Small pictures are enlarged, so that lines and words can be read.
_LEAST_WIDTH_PX = 640
_CAPTION_PX = 28
_DIMMED = 0.35
_NEUTRAL = 96


@dataclass(frozen=True, slots=True, eq=False)
class CommonField:
    """What a survey found, in ideal pixels of one image: a polygon (k, 2) per plane, points (n, 2), plane of each."""

    polygons_px: tuple[Floats, ...] = ()
    points_px: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    plane_of_point: tuple[int, ...] = ()


def overlay(keyframe: Keyframe, common: CommonField | None, caption: str) -> bytes:
    """PNG of the keyframe with the common field and a caption; None for a pair whose field is not known."""
    ground, scale = _enlarged(_ground(keyframe))
    if common is not None:
        ground = _draw(ground, common, scale)
    return canvas.png(_captioned(ground, caption))


def _ground(keyframe: Keyframe) -> Picture:
    """The ideal (undistorted) picture to draw on; without an image its thumbnail, or its keypoints on grey."""
    camera = keyframe.camera
    for data in (keyframe.image, keyframe.thumbnail):
        picture = _decode(data) if data else None
        if picture is not None:
            full = cv2.resize(picture, (camera.width, camera.height), interpolation=cv2.INTER_CUBIC)
            return _undistorted(np.asarray(full, np.uint8), camera)
    neutral: Picture = np.full((camera.height, camera.width, 3), _NEUTRAL, np.uint8)
    if keyframe.features is not None:
        for point_px in undistort(camera, keyframe.features.keypoints_px):
            canvas.dot(neutral, point_px, 0.5, canvas.GREY, canvas.GREY)
    return neutral


def _decode(data: bytes) -> Picture | None:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    return None if picture is None else np.asarray(picture, np.uint8)


def _undistorted(picture: Picture, camera: Camera) -> Picture:
    coefficients = np.array(camera.coefficients, np.float64)
    match camera.distortion:
        case "none":
            return picture
        case "plumb_bob":
            ideal = cv2.undistort(picture, camera.matrix, coefficients)
        case "equidistant":
            ideal = cv2.fisheye.undistortImage(picture, camera.matrix, coefficients, Knew=camera.matrix)
    return np.asarray(ideal, np.uint8)


def _enlarged(picture: Picture) -> tuple[Picture, int]:
    scale = max(1, -(-_LEAST_WIDTH_PX // picture.shape[1]))
    if scale == 1:
        return picture.copy(), 1
    size = (picture.shape[1] * scale, picture.shape[0] * scale)
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_CUBIC), np.uint8), scale


def _draw(ground: Picture, common: CommonField, scale: int) -> Picture:
    polygons_px = [_scaled(polygon, scale) for polygon in common.polygons_px]
    seen = canvas.mask_of(ground.shape[:2], polygons_px).astype(np.float32)[..., None] / 255.0
    grey = cv2.cvtColor(cv2.cvtColor(ground, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    drawn: Picture = np.rint(ground * seen + grey * (_DIMMED * (1.0 - seen))).astype(np.uint8)
    for index, polygon_px in enumerate(polygons_px):
        if len(polygon_px) >= 3:
            canvas.fill(drawn, polygon_px, canvas.palette(index), 0.22)
            canvas.line(drawn, polygon_px, canvas.palette(index), 2, closed=True)
    for point_px, plane in zip(_scaled(common.points_px, scale), common.plane_of_point, strict=True):
        canvas.dot(drawn, point_px, 2.0, canvas.YELLOW if plane >= 0 else canvas.GREY)
    return drawn


def _scaled(points_px: Floats, scale: int) -> Floats:
    """Places in the enlarged picture; pixel centres are at integers."""
    return np.asarray((points_px + 0.5) * scale - 0.5, np.float64)


def _captioned(picture: Picture, caption: str) -> Picture:
    bar: Picture = np.full((_CAPTION_PX, picture.shape[1], 3), canvas.INK, np.uint8)
    canvas.text(bar, caption, (8, 19), canvas.PAPER)
    return np.vstack([picture, bar])
