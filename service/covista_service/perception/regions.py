"""The common field as polygons: around the cells of a surface that another camera sees.

A region is one closed line. Its outer border runs clockwise as one sees the image, and into every hole, round it the
other way, and back by a seam of no width. So a consumer who fills each region by itself gets it right, whether by the
even-odd or by the nonzero rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Camera, Floats
from covista_service.perception.polygon import Polygon

Mask = NDArray[np.bool_]
Line = NDArray[np.int64]
# To the right, down, left, up.
_RIGHT, _DOWN = (1, 0, -1, 0), (0, 1, 0, -1)
_DONE = 2


@dataclass(frozen=True, slots=True)
class RegionOptions:
    """Specks of less than `least_cells` cells are left out, and holes of less are filled."""

    least_cells: int = 3


def regions(mask: Mask, camera: Camera, options: RegionOptions) -> list[Polygon]:
    """The regions in ideal px of the image whose cells (ROWS, COLUMNS) are marked, the largest first.

    Borders cut the corners of cells: straight from one cell's side to the next. Cells that touch by a corner only
    belong to regions of their own. All areas together are the marked share of the image, less half a cell for each
    region, more half a cell for each hole.
    """
    mask = _without_specks(mask, options.least_cells)
    _, parts = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
    points, starts, cells = _borders(_sides(mask))
    rings = [points[begin:end] for begin, end in pairwise(starts.tolist())]
    holes: dict[int, list[Line]] = {}
    outer: dict[int, Line] = {}
    for ring, (row, column) in zip(rings, cells, strict=True):
        part = int(parts[row, column])
        if _doubled_area(ring) > 0:
            outer[part] = ring
        else:
            holes.setdefault(part, []).append(ring)
    lines = [_joined(ring, holes.get(part, [])) for part, ring in outer.items()]
    # Points are given in half cells.
    scale = np.array([camera.width, camera.height]) / mask.shape[::-1] / 2
    return [_polygon(line, scale) for line in sorted(lines, key=_doubled_area, reverse=True)]


def _without_specks(mask: Mask, least_cells: int) -> Mask:
    for kept, connectivity in ((True, 4), (False, 8)):
        _, parts, stats, _ = cv2.connectedComponentsWithStats(
            (mask == kept).astype(np.uint8), connectivity=connectivity
        )
        small = stats[:, cv2.CC_STAT_AREA] < least_cells
        small[0] = False
        mask = mask ^ small[parts]
    return np.asarray(mask, np.bool_)


@compiled
def _borders(sides: NDArray[np.uint8]) -> tuple[Line, NDArray[np.int64], NDArray[np.int64]]:
    """Closed lines along sides: points (n, 2) in half cells, where each line starts and ends, a cell on its right.

    Points are the middles of sides, and on the image's own border the corners of cells.
    """
    _, rows, columns = sides.shape
    count, lines, total = 0, 0, int((sides > 0).sum())
    points = np.empty((2 * total, 2), np.int64)
    starts = np.zeros(total + 1, np.int64)
    cells = np.empty((total, 2), np.int64)
    for first in np.flatnonzero(sides):
        way, r, c = first // (rows * columns), first // columns % rows, first % columns
        if sides[way, r, c] == _DONE:
            continue
        cells[lines] = r - (way in (2, 3)), c - (way in (1, 2))
        while sides[way, r, c] != _DONE:
            sides[way, r, c] = _DONE
            from_r, from_c = r, c
            r, c = r + _DOWN[way], c + _RIGHT[way]
            if not (from_r == r == 0 or from_r == r == rows - 1 or from_c == c == 0 or from_c == c == columns - 1):
                points[count] = from_c + c, from_r + r
                count += 1
            if r in (0, rows - 1) or c in (0, columns - 1):
                points[count] = 2 * c, 2 * r
                count += 1
            way = _onwards(sides, way, r, c)
        lines += 1
        starts[lines] = count
    return points[:count], starts[: lines + 1], cells[:lines]


@compiled
def _onwards(sides: NDArray[np.uint8], way: int, r: int, c: int) -> int:
    """The way on from a corner: round the same cell if that can be, so that cells that touch by it are kept apart."""
    for turn in (1, 0):
        if sides[(way + turn) % 4, r, c]:
            return (way + turn) % 4
    return (way + 3) % 4


def _sides(mask: Mask) -> NDArray[np.uint8]:
    """Whether a marked cell's side leads from a corner (4, ROWS + 1, COLUMNS + 1) to the right, down, left, or up.

    The cell lies to the right of the way.
    """
    around = np.pad(mask, 1)
    here = around[1:-1, 1:-1]
    sides = np.zeros((4, mask.shape[0] + 1, mask.shape[1] + 1), np.uint8)
    sides[0, :-1, :-1] = here & ~around[:-2, 1:-1]
    sides[1, :-1, 1:] = here & ~around[1:-1, 2:]
    sides[2, 1:, 1:] = here & ~around[2:, 1:-1]
    sides[3, 1:, :-1] = here & ~around[1:-1, :-2]
    return sides


def _doubled_area(line: Line) -> int:
    """Twice the area of a closed line, positive where it runs clockwise as one sees the image."""
    x, y = line.T
    return int((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def _joined(line: Line, holes: list[Line]) -> Line:
    """One line out of an outer border and its holes: always by the shortest seam, which crosses nothing."""
    # Squared length of each hole's seam, and the indices of its ends in the line and in the hole.
    seams = np.array([_seam(line, hole) for hole in holes], np.int64).reshape(-1, 3)
    left = np.ones(len(holes), np.bool_)
    while left.any():
        nearest = int(np.where(left, seams[:, 0], np.iinfo(np.int64).max).argmin())
        left[nearest] = False
        _, here, there = seams[nearest].tolist()
        around = np.roll(holes[nearest], -there, axis=0)
        line = np.concatenate((line[: here + 1], around, around[:1], line[here:]))
        seams[seams[:, 1] > here, 1] += len(around) + 2
        for k in np.flatnonzero(left):
            shorter = _seam(around, holes[k])
            if shorter[0] < seams[k, 0]:
                seams[k] = shorter[0], here + 1 + shorter[1], shorter[2]
    return line


def _seam(line: Line, hole: Line) -> tuple[int, int, int]:
    """Squared length of the shortest way between two lines' points, and their indices."""
    squared = ((line[:, None] - hole[None]) ** 2).sum(axis=2)
    here, there = np.unravel_index(int(squared.argmin()), squared.shape)
    return int(squared[here, there]), int(here), int(there)


def _polygon(line: Line, scale: Floats) -> Polygon:
    """Its corners only, in px."""
    come, go = line - np.roll(line, 1, axis=0), np.roll(line, -1, axis=0) - line
    bends = (come[:, 0] * go[:, 1] != come[:, 1] * go[:, 0]) | ((come * go).sum(axis=1) <= 0)
    return [(x, y) for x, y in (line[bends] * scale - 0.5).tolist()]
