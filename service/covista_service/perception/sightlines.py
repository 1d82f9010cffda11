"""Along every line of sight of one camera into another's image: the compiled part of visibility.

A cell (c, r) at inverse depth rho lies at A (c, r, 1) + rho b in the other image, up to scale. Images are measured in
cells: the image of a camera spans [0, COLUMNS] x [0, ROWS].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats
from covista_service.perception.surface import COLUMNS, ROWS

Mask = NDArray[np.bool_]
_AHEAD = 1e-9
# Places of the clues; what they say stands at `visibility.Clues`.
CLUES = 5
_APART, _BEFORE, _HIDDEN, _INNER, _OUTER = 0, 1, 2, 3, 4
# Further apart than this share of its inverse depth, a surface is simply another one.
_FARTHEST_APART = 0.5
# The slope of a surface is taken over so many cells to either side.
_STEP = 2


@compiled
def in_cells(matrices: Floats, sizes: Floats) -> tuple[Floats, Floats, Floats]:
    """`cells_from_rays`, `rays_from_cells` and `cell_px` of a gallery."""
    cells_from_rays, rays_from_cells = np.zeros((len(sizes), 3, 3)), np.zeros((len(sizes), 3, 3))
    cell_px = np.empty((len(sizes), 2))
    for k in range(len(sizes)):
        fx, skew, fy = matrices[k, 0, 0], matrices[k, 0, 1], matrices[k, 1, 1]
        wide, high = sizes[k, 0] / COLUMNS, sizes[k, 1] / ROWS
        cell_px[k] = wide, high
        # Cells count from the image's border, pixels from the middle of the first ...
        cells_from_rays[k, 0] = fx / wide, skew / wide, (matrices[k, 0, 2] + 0.5) / wide
        cells_from_rays[k, 1] = 0.0, fy / high, (matrices[k, 1, 2] + 0.5) / high
        # ... and indices from the middle of the first cell.
        down = (0.5 * high - 0.5 - matrices[k, 1, 2]) / fy
        across = (0.5 * wide - 0.5 - matrices[k, 0, 2]) / fx
        rays_from_cells[k, 0] = wide / fx, -skew * high / (fx * fy), across - skew * down / fx
        rays_from_cells[k, 1] = 0.0, high / fy, down
        cells_from_rays[k, 2, 2] = rays_from_cells[k, 2, 2] = 1.0
    return cells_from_rays, rays_from_cells, cell_px


@compiled
def ranges(inverse_depth: Floats) -> Floats:
    """`range_of_row` of a gallery."""
    found = np.empty((len(inverse_depth), ROWS, 2))
    for k in range(len(inverse_depth)):
        for r in range(ROWS):
            least, most = inverse_depth[k, r, 0], inverse_depth[k, r, 0]
            for c in range(1, COLUMNS):
                least, most = min(least, inverse_depth[k, r, c]), max(most, inverse_depth[k, r, c])
            found[k, r] = least, most
    return found


@compiled
def look(
    pairs: NDArray[np.int64],
    rotations: Floats,
    translations: Floats,
    ratios: Floats,
    cells_from_rays: Floats,
    rays_from_cells: Floats,
    cell_px: Floats,
    inverse_depth: Floats,
    sigma: Floats,
    range_of_row: Floats,
    limits: Floats,
    masks: Mask,
    clues: Floats,
) -> NDArray[np.int64]:
    """Number of cells seen of each pair; masks are written to `masks`, over and over if there are fewer of them.

    `limits`: tolerance, squared parallax in px, tolerance between unconnected keyframes, the edge in image widths, and
    how far a camera is clearly beyond a surface.
    `clues` (n, CLUES) is filled, unless it is empty.
    """
    counts = np.empty(len(pairs), np.int64)
    weigh = len(clues) > 0
    nothing = np.empty(CLUES)
    forms, wide = np.empty((5, 4)), np.empty((5, 4))
    spans = np.empty((ROWS, 2), np.int64)
    found = np.empty(ROWS * COLUMNS)
    for k in range(len(pairs)):
        i, j = pairs[k]
        mask = masks[k % len(masks)]
        mask[:] = False
        mine = clues[k] if weigh else nothing
        mine[:] = 0.0
        project(rotations[k], translations[k], cells_from_rays[j], rays_from_cells[i], forms)
        edge_px = limits[3] * COLUMNS * cell_px[j, 0] if weigh else 0.0
        _widen(forms, edge_px / cell_px[j, 0], edge_px / cell_px[j, 1], wide)
        _frame(wide, range_of_row[i], spans)
        connected = ratios[k, 0] == 1 and ratios[k, 1] == 1
        ratio = 1.0
        if not connected:
            ratio = _median_ratio(forms, spans, inverse_depth[i], inverse_depth[j], found)
            # A wall between two parts looks like another scale: no more is taken out than scales can be off by.
            ratio = min(max(ratio, ratios[k, 0]), ratios[k, 1])
        counts[k] = _seen(
            forms,
            _epipole(rotations[k], translations[k], cells_from_rays[i]),
            cell_px[i],
            cell_px[j],
            edge_px,
            spans,
            inverse_depth[i],
            inverse_depth[j],
            sigma[j],
            limits,
            ratio,
            connected,
            mask,
            mine,
        )
    return counts


@compiled
def project(
    rotation: Floats, translation: Floats, cells_from_rays: Floats, rays_from_cells: Floats, out: Floats
) -> None:
    """Five linear forms in (c, r, 1, inverse depth), all positive where a cell of the first lies in the second image.

    U, V and W, for (U / W, V / W) is the place in cells of the second image; then how much is left of W to its right
    and lower borders.
    """
    for a in range(3):
        m = cells_from_rays[a]
        for b in range(3):
            out[a, b] = 0.0
            for d in range(3):
                turned = m[0] * rotation[0, d] + m[1] * rotation[1, d] + m[2] * rotation[2, d]
                out[a, b] += turned * rays_from_cells[d, b]
        out[a, 3] = m[0] * translation[0] + m[1] * translation[1] + m[2] * translation[2]
    for b in range(4):
        out[3, b] = COLUMNS * out[2, b] - out[0, b]
        out[4, b] = ROWS * out[2, b] - out[1, b]


@compiled
def _epipole(rotation: Floats, translation: Floats, cells_from_rays: Floats) -> tuple[float, float, float]:
    """The second camera's centre in cells of the first image (x, y, w)."""
    x, y, z = 0.0, 0.0, 0.0
    for a in range(3):
        x -= rotation[a, 0] * translation[a]
        y -= rotation[a, 1] * translation[a]
        z -= rotation[a, 2] * translation[a]
    m = cells_from_rays
    return m[0, 0] * x + m[0, 1] * y + m[0, 2] * z, m[1, 1] * y + m[1, 2] * z, z


@compiled
def _frame(forms: Floats, range_of_row: Floats, out: NDArray[np.int64]) -> None:
    """Columns [begin, end) of each row outside which no inverse depth in the row's range lies in the image."""
    for r in range(ROWS):
        begin, end = 0.0, float(COLUMNS)
        for k in range(5):
            slope = forms[k, 0]
            most = max(forms[k, 3] * range_of_row[r, 0], forms[k, 3] * range_of_row[r, 1])
            most += forms[k, 1] * r + forms[k, 2]
            # A column more on either side: sums are not rounded here as they are at the cells.
            if slope > 0:
                begin = max(begin, -most / slope - 1)
            elif slope < 0:
                end = min(end, -most / slope + 2)
            elif most < 0:
                end = 0.0
        out[r, 0] = int(min(begin, float(COLUMNS)))
        out[r, 1] = int(max(end, 0.0))


@compiled
def _widen(forms: Floats, across: float, along: float, out: Floats) -> None:
    """The same forms for an image that is so many cells wider on each side."""
    for b in range(4):
        out[0, b] = forms[0, b] + across * forms[2, b]
        out[1, b] = forms[1, b] + along * forms[2, b]
        out[2, b] = forms[2, b]
        out[3, b] = forms[3, b] + across * forms[2, b]
        out[4, b] = forms[4, b] + along * forms[2, b]


@compiled
def _seen(
    forms: Floats,
    epipole: tuple[float, float, float],
    cell_px: Floats,
    other_cell_px: Floats,
    edge_px: float,
    spans: NDArray[np.int64],
    rho: Floats,
    other_rho: Floats,
    other_sigma: Floats,
    limits: Floats,
    ratio: float,
    connected: bool,
    mask: Mask,
    clues: Floats,
) -> int:
    """Number of cells seen, which, and the clues; `ratio` of the scale of the first keyframe's depths to the second's.

    Without `connected` the two know of no more than that ratio.
    """
    count = 0
    weigh = edge_px > 0
    ahead, room, parallax = epipole[2], limits[0] if connected else limits[2], limits[1]
    for r in range(ROWS):
        u0, v0, w0 = (
            forms[0, 1] * r + forms[0, 2],
            forms[1, 1] * r + forms[1, 2],
            forms[2, 1] * r + forms[2, 2],
        )
        down = (epipole[1] - (r + 0.5) * ahead) * cell_px[1]
        for c in range(spans[r, 0], spans[r, 1]):
            here = rho[r, c]
            w = forms[2, 0] * c + w0 + forms[2, 3] * here
            if w <= _AHEAD:
                continue
            u = (forms[0, 0] * c + u0 + forms[0, 3] * here) / w
            v = (forms[1, 0] * c + v0 + forms[1, 3] * here) / w
            if not (0 <= u < COLUMNS and 0 <= v < ROWS):
                if weigh:
                    clues[_OUTER] += max(0.0, 1 + _margin_px(u, v, other_cell_px) / edge_px)
                continue
            # As if measured in the first image: by how much the second surface is nearer along the ray.
            there = _sampled(other_rho, u, v) * w * ratio
            trusted = room + other_sigma[int(v), int(u)] if connected else room
            hidden = here < there * (1 - trusted)
            if not hidden and _beyond(rho, r, c, epipole, limits[4]):
                mask[r, c] = False
                continue
            if hidden and connected:
                nearer = there - here
                along = (epipole[0] - (c + 0.5) * ahead) * cell_px[0]
                left = 1 + nearer * ahead
                hidden = left <= 0 or nearer * nearer * (along * along + down * down) > parallax * left * left
            mask[r, c] = not hidden
            count += not hidden
            if weigh:
                _weigh(u, v, here / there, trusted, hidden, edge_px, other_cell_px, clues)
    if weigh:
        clues /= ROWS * COLUMNS
    return count


@compiled
def _beyond(rho: Floats, r: int, c: int, epipole: tuple[float, float, float], clearly: float) -> bool:
    """Does the other camera look at a cell from behind: is it clearly beyond the plane that the surface has there?

    Inverse depth is affine on a plane: rho = a (c + .5) + b (r + .5) + d, and 1 - (a, b, d) . X, with X in cells times
    depth, is positive on the side of the first camera (section 3 of the method: 1 + u . C2).
    """
    left, right = max(c - _STEP, 0), min(c + _STEP, COLUMNS - 1)
    upper, lower = max(r - _STEP, 0), min(r + _STEP, ROWS - 1)
    across = (rho[r, right] - rho[r, left]) / (right - left)
    down = (rho[lower, c] - rho[upper, c]) / (lower - upper)
    x, y, w = epipole
    side = 1 - across * (x - (c + 0.5) * w) - down * (y - (r + 0.5) * w) - rho[r, c] * w
    return bool(side < -clearly)


@compiled
def _weigh(
    u: float,
    v: float,
    ratio: float,
    trusted: float,
    hidden: bool,
    edge_px: float,
    other_cell_px: Floats,
    clues: Floats,
) -> None:
    """Enter what a cell that lies in the other image tells of how sure the count is."""
    if hidden:
        clues[_HIDDEN] += 1
        return
    clues[_INNER] += max(0.0, 1 - _margin_px(u, v, other_cell_px) / edge_px)
    clues[_BEFORE if ratio > 1 + trusted else _APART] += min(abs(ratio - 1), _FARTHEST_APART)


@compiled
def _margin_px(u: float, v: float, cell_px: Floats) -> float:
    """Px from a place in cells to the border of the image; outside negative, by the farther of two borders missed."""
    return float(min(min(u, COLUMNS - u) * cell_px[0], min(v, ROWS - v) * cell_px[1]))


@compiled
def _median_ratio(forms: Floats, spans: NDArray[np.int64], rho: Floats, other_rho: Floats, found: Floats) -> float:
    """Median of the first surface's inverse depths over the second's, where they meet; 1 if nowhere."""
    met = 0
    for r in range(ROWS):
        for c in range(spans[r, 0], spans[r, 1]):
            here = rho[r, c]
            w = forms[2, 0] * c + forms[2, 1] * r + forms[2, 2] + forms[2, 3] * here
            if w <= _AHEAD:
                continue
            u = (forms[0, 0] * c + forms[0, 1] * r + forms[0, 2] + forms[0, 3] * here) / w
            v = (forms[1, 0] * c + forms[1, 1] * r + forms[1, 2] + forms[1, 3] * here) / w
            if 0 <= u < COLUMNS and 0 <= v < ROWS:
                found[met] = here / (_sampled(other_rho, u, v) * w)
                met += 1
    return float(np.median(found[:met])) if met else 1.0


@compiled
def _sampled(grid: Floats, u: float, v: float) -> float:
    """Bilinear between the cells' centres, constant beyond the outermost, at a place in cells."""
    x, y = min(max(u - 0.5, 0.0), COLUMNS - 1.0), min(max(v - 0.5, 0.0), ROWS - 1.0)
    j, i = min(int(x), COLUMNS - 2), min(int(y), ROWS - 2)
    x, y = x - j, y - i
    upper = grid[i, j] + x * (grid[i, j + 1] - grid[i, j])
    lower = grid[i + 1, j] + x * (grid[i + 1, j + 1] - grid[i + 1, j])
    return float(upper + y * (lower - upper))
