"""The common field of view drawn in a keyframe, as the paper's Figs. 2 to 4 show it.

What the other camera does not see is dimmed, planes are tinted where they are common, matched points are yellow.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from covista_service.drawing import canvas
from covista_service.drawing.canvas import Picture
from covista_service.perception.camera import Camera, Floats, undistort
from covista_service.station.events import Keyframe

# Small pictures are enlarged, so that lines and words can be read; large ones are reduced, and a camera may claim any
# size as long as it sends features only.
_LEAST_WIDTH_PX = 640
_MOST_PX = 2048
_CAPTION_PX = 28
_GAP_PX = 8
_DIMMED = 0.35
_NEUTRAL = 96


@dataclass(frozen=True, slots=True, eq=False)
class CommonField:
    """What is known of the common field, in ideal pixels of one image.

    `regions_px`: polygons (k, 2) whose insides, by the even-odd rule, the other camera sees. `polygons_px`: one (k, 2)
    for each plane that explains them, with points (n, 2) and the plane of each. Without regions the planes are all.
    """

    regions_px: tuple[Floats, ...] = ()
    polygons_px: tuple[Floats, ...] = ()
    points_px: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    plane_of_point: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """A keyframe of a pair, its common field (None where that is not known), and a caption (ASCII)."""

    keyframe: Keyframe
    common: CommonField | None
    caption: str


def overlay(keyframe: Keyframe, common: CommonField | None, caption: str) -> bytes:
    """PNG of the keyframe with the common field and a caption; None for a pair whose field is not known."""
    return canvas.png(_drawn(Side(keyframe, common, caption)))


def view(keyframe: Keyframe) -> bytes:
    """PNG of what a keyframe shows: its image, or its thumbnail, or its keypoints."""
    return canvas.png(_ground(keyframe, _scale(keyframe.camera)))


def side_by_side(first: Side, second: Side) -> bytes:
    """PNG of both keyframes of a pair, the same plane in the same colour."""
    pictures = [_drawn(side) for side in (first, second)]
    height = max(picture.shape[0] for picture in pictures)
    gap: Picture = np.full((height, _GAP_PX, 3), canvas.PAPER, np.uint8)
    left, right = (_lengthened(picture, height) for picture in pictures)
    return canvas.png(np.hstack([left, gap, right]))


def _drawn(side: Side) -> Picture:
    scale = _scale(side.keyframe.camera)
    ground = _ground(side.keyframe, scale)
    if side.common is not None:
        ground = _draw(ground, side.common, scale)
    return _captioned(ground, side.caption)


def _lengthened(picture: Picture, height: int) -> Picture:
    paper: Picture = np.full((height, picture.shape[1], 3), canvas.PAPER, np.uint8)
    paper[: picture.shape[0]] = picture
    return paper


def _scale(camera: Camera) -> float:
    """Pixels drawn per pixel of the camera."""
    enlarged = max(1, -(-_LEAST_WIDTH_PX // camera.width))
    return min(float(enlarged), _MOST_PX / max(camera.width, camera.height))


def _ground(keyframe: Keyframe, scale: float) -> Picture:
    """The ideal (undistorted) picture to draw on; without an image its thumbnail, or its keypoints on grey."""
    camera = keyframe.camera
    width, height = (max(1, round(length * scale)) for length in (camera.width, camera.height))
    for data in (keyframe.image, keyframe.thumbnail):
        picture = _decode(data) if data else None
        if picture is not None:
            way = cv2.INTER_AREA if picture.shape[1] > width else cv2.INTER_CUBIC
            return _undistorted(
                np.asarray(cv2.resize(picture, (width, height), interpolation=way), np.uint8), camera, scale
            )
    neutral: Picture = np.full((height, width, 3), _NEUTRAL, np.uint8)
    if keyframe.features is not None:
        for point_px in _scaled(undistort(camera, keyframe.features.keypoints_px), scale):
            canvas.dot(neutral, point_px, max(0.5, 0.5 * scale), canvas.GREY, canvas.GREY)
    return neutral


def _decode(data: bytes) -> Picture | None:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    return None if picture is None else np.asarray(picture, np.uint8)


def _undistorted(picture: Picture, camera: Camera, scale: float) -> Picture:
    """The picture, which is `scale` times as large as the camera's, without the lens's distortion."""
    coefficients = np.array(camera.coefficients, np.float64)
    matrix = camera.matrix.copy()
    matrix[:2] *= scale
    matrix[:2, 2] = _scaled(camera.matrix[:2, 2], scale)
    match camera.distortion:
        case "none":
            return picture
        case "plumb_bob":
            ideal = cv2.undistort(picture, matrix, coefficients)
        case "equidistant":
            ideal = cv2.fisheye.undistortImage(picture, matrix, coefficients, Knew=matrix)
    return np.asarray(ideal, np.uint8)


def _draw(ground: Picture, common: CommonField, scale: float) -> Picture:
    polygons_px = [_scaled(polygon, scale) for polygon in common.polygons_px]
    regions_px = [_scaled(region, scale) for region in common.regions_px]
    seen = canvas.mask_of(ground.shape[:2], regions_px or polygons_px).astype(np.float32)[..., None] / 255.0
    grey = cv2.cvtColor(cv2.cvtColor(ground, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    drawn: Picture = np.rint(ground * seen + grey * (_DIMMED * (1.0 - seen))).astype(np.uint8)
    tinted = drawn.copy()
    for index, polygon_px in enumerate(polygons_px):
        if len(polygon_px) >= 3:
            canvas.fill(tinted, polygon_px, canvas.palette(index), 0.22)
            canvas.line(tinted, polygon_px, canvas.palette(index), 2, closed=True)
    drawn = np.rint(tinted * seen + drawn * (1.0 - seen)).astype(np.uint8)
    if regions_px:
        # The border of what is seen: a region's own line runs along seams to its holes too.
        outlines, _ = cv2.findContours((seen[..., 0] > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(drawn, outlines, -1, canvas.PAPER, 1)
    for point_px, plane in zip(_scaled(common.points_px, scale), common.plane_of_point, strict=True):
        canvas.dot(drawn, point_px, 2.0, canvas.YELLOW if plane >= 0 else canvas.GREY)
    return drawn


def _scaled(points_px: Floats, scale: float) -> Floats:
    """Places in the picture as drawn; pixel centres are at integers."""
    return np.asarray((points_px + 0.5) * scale - 0.5, np.float64)


def _captioned(picture: Picture, caption: str) -> Picture:
    bar: Picture = np.full((_CAPTION_PX, picture.shape[1], 3), canvas.INK, np.uint8)
    canvas.text(bar, caption, (8, 19), canvas.PAPER)
    return np.vstack([picture, bar])
