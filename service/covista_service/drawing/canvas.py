"""Pen and paper: colours that colour-blind people tell apart, smooth shapes at sub-pixel places, words."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
Colour = tuple[int, int, int]

# Okabe and Ito's palette, BGR, without black and yellow, which mean points and text here.
PALETTE: tuple[Colour, ...] = (
    (233, 180, 86),
    (0, 159, 230),
    (115, 158, 0),
    (167, 121, 204),
    (178, 114, 0),
    (0, 94, 213),
)
YELLOW: Colour = (66, 228, 240)
INK: Colour = (40, 40, 40)
PAPER: Colour = (250, 250, 250)
PENCIL: Colour = (110, 110, 110)
GREY: Colour = (170, 170, 170)
_SHIFT = 4
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def palette(index: int) -> Colour:
    """The colour of the plane or group with this index."""
    return PALETTE[index % len(PALETTE)]


def fill(picture: Picture, polygon_px: NDArray[np.floating], colour: Colour, opacity: float) -> None:
    """Fill a polygon (k, 2), translucent."""
    mask = np.zeros(picture.shape[:2], np.uint8)
    cv2.fillPoly(mask, [_fixed(polygon_px)], 255, cv2.LINE_AA, _SHIFT)
    share = (mask.astype(np.float32) * (opacity / 255.0))[..., None]
    mixed = picture * (1.0 - share) + np.array(colour, np.float32) * share
    picture[:] = np.rint(mixed).astype(np.uint8)


def line(
    picture: Picture, points_px: NDArray[np.floating], colour: Colour, width: int = 1, *, closed: bool = False
) -> None:
    """Draw a line through points (k, 2)."""
    cv2.polylines(picture, [_fixed(points_px)], closed, colour, width, cv2.LINE_AA, _SHIFT)


def dot(picture: Picture, point_px: NDArray[np.floating], radius_px: float, colour: Colour, edge: Colour = INK) -> None:
    """Draw a dot with an edge that sets it off from any ground."""
    x, y = (int(value) for value in _fixed(point_px)[0, 0])
    unit = 1 << _SHIFT
    cv2.circle(picture, (x, y), round((radius_px + 1) * unit), edge, -1, cv2.LINE_AA, _SHIFT)
    cv2.circle(picture, (x, y), round(radius_px * unit), colour, -1, cv2.LINE_AA, _SHIFT)


def text_width(words: str, scale: float = 0.5) -> int:
    """How wide words are."""
    return int(cv2.getTextSize(words, _FONT, scale, 1)[0][0])


def text(picture: Picture, words: str, place_px: tuple[int, int], colour: Colour = INK, scale: float = 0.5) -> None:
    """Write words (ASCII) with their left foot at a place."""
    cv2.putText(picture, words, place_px, _FONT, scale, colour, 1, cv2.LINE_AA)


def mask_of(shape: tuple[int, int], polygons_px: Sequence[NDArray[np.floating]]) -> Picture:
    """Where any of the polygons is: 255, (H, W)."""
    mask = np.zeros(shape, np.uint8)
    for polygon_px in (polygon for polygon in polygons_px if len(polygon) >= 3):
        cv2.fillPoly(mask, [_fixed(polygon_px)], 255, cv2.LINE_AA, _SHIFT)
    return mask


def png(picture: Picture) -> bytes:
    """The picture as PNG bytes."""
    done, data = cv2.imencode(".png", picture)
    if not done:
        raise ValueError(f"OpenCV cannot encode a picture of shape {picture.shape}")
    return bytes(data)


def _fixed(points_px: NDArray[np.floating]) -> NDArray[np.int32]:
    """Points (k, 2) as OpenCV wants them for sub-pixel places: (k, 1, 2) in sixteenths."""
    limited = np.clip(np.asarray(points_px, np.float64).reshape(-1, 1, 2), -1e5, 1e5)
    return np.rint(limited * (1 << _SHIFT)).astype(np.int32)
