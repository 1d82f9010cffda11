"""Along every line of sight of one camera into another's image: the compiled part of visibility.

A cell (c, r) at inverse depth rho lies at A (c, r, 1) + rho b in the other image, up to scale. Images are measured in
cells: the image of a camera spans [0, COLUMNS] x [0, ROWS].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Floats
from covista_service.perception.compiled import compiled
from covista_service.perception.surface import COLUMNS, ROWS

Mask = NDArray[np.bool_]
_AHEAD = 1e-9


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
def look(
    pairs: NDArray[np.int64],
    rotations: Floats,
    translations: Floats,
    connected: Mask,
    cells_from_rays: Floats,
    rays_from_cells: Floats,
    cell_px: Floats,
    inverse_depth: Floats,
    sigma: Floats,
    range_of_row: Floats,
    tolerances: Floats,
    masks: Mask,
) -> NDArray[np.int64]:
    """Number of cells seen of each pair; masks are written to `masks`, over and over if there are fewer of them."""
    counts = np.empty(len(pairs), np.int64)
    forms = np.empty((5, 4))
    spans = np.empty((ROWS, 2), np.int64)
    ratios = np.empty(ROWS * COLUMNS)
    for k in range(len(pairs)):
        i, j = pairs[k]
        mask = masks[k % len(masks)]
        mask[:] = False
        _project(rotations[k], translations[k], cells_from_rays[j], rays_from_cells[i], forms)
        _frame(forms, range_of_row[i], spans)
        if connected[k]:
            epipole = _epipole(rotations[k], translations[k], cells_from_rays[i])
            counts[k] = _connected(
                forms, epipole, cell_px[i], spans, inverse_depth[i], inverse_depth[j], sigma[j], tolerances, mask
            )
        else:
            counts[k] = _unconnected(forms, spans, inverse_depth[i], inverse_depth[j], tolerances[2], ratios, mask)
    return counts


@compiled
def _project(
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
def _connected(
    forms: Floats,
    epipole: tuple[float, float, float],
    cell_px: Floats,
    spans: NDArray[np.int64],
    rho: Floats,
    other_rho: Floats,
    other_sigma: Floats,
    tolerances: Floats,
    mask: Mask,
) -> int:
    """Number of cells seen, and which, between keyframes whose depths have one scale."""
    count = 0
    ahead, hidden_from, parallax = epipole[2], 1 - tolerances[0], tolerances[1]
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
                continue
            # As if measured in the first image: by how much the second surface is nearer along the ray.
            there = _sampled(other_rho, u, v) * w
            visible = True
            if here < there * (hidden_from - other_sigma[int(v), int(u)]):
                nearer = there - here
                along = (epipole[0] - (c + 0.5) * ahead) * cell_px[0]
                left = 1 + nearer * ahead
                visible = left > 0 and nearer * nearer * (along * along + down * down) <= parallax * left * left
            mask[r, c] = visible
            count += visible
    return count


@compiled
def _unconnected(
    forms: Floats,
    spans: NDArray[np.int64],
    rho: Floats,
    other_rho: Floats,
    tolerance: float,
    ratios: Floats,
    mask: Mask,
) -> int:
    """Number of cells seen, and which, where only the ratio of two scales is known: by its median."""
    met = 0
    for r in range(ROWS):
        u0, v0, w0 = (
            forms[0, 1] * r + forms[0, 2],
            forms[1, 1] * r + forms[1, 2],
            forms[2, 1] * r + forms[2, 2],
        )
        for c in range(spans[r, 0], spans[r, 1]):
            here = rho[r, c]
            w = forms[2, 0] * c + w0 + forms[2, 3] * here
            if w <= _AHEAD:
                continue
            u = (forms[0, 0] * c + u0 + forms[0, 3] * here) / w
            v = (forms[1, 0] * c + v0 + forms[1, 3] * here) / w
            if 0 <= u < COLUMNS and 0 <= v < ROWS:
                ratios[met] = here / (_sampled(other_rho, u, v) * w)
                mask[r, c] = True
                met += 1
    if met == 0:
        return 0
    least = np.median(ratios[:met]) * (1 - tolerance)
    count, met = 0, 0
    for r in range(ROWS):
        for c in range(spans[r, 0], spans[r, 1]):
            if mask[r, c]:
                mask[r, c] = ratios[met] >= least
                count += mask[r, c]
                met += 1
    return count


@compiled
def _sampled(grid: Floats, u: float, v: float) -> float:
    """Bilinear between the cells' centres, constant beyond the outermost, at a place in cells."""
    x, y = min(max(u - 0.5, 0.0), COLUMNS - 1.0), min(max(v - 0.5, 0.0), ROWS - 1.0)
    j, i = min(int(x), COLUMNS - 2), min(int(y), ROWS - 2)
    x, y = x - j, y - i
    upper = grid[i, j] + x * (grid[i, j + 1] - grid[i, j])
    lower = grid[i + 1, j] + x * (grid[i + 1, j + 1] - grid[i + 1, j])
    return float(upper + y * (lower - upper))
