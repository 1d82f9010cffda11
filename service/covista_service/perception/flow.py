"""Many surfaces as they look after a small motion of their cameras: fast, for a robot that tells its pose often.

A cell (c, r) of the new image at inverse depth rho lies at A (c, r, 1) + rho b = (U, V, W) in the old one, where the
surface S says what its depth is: rho = S(U / W, V / W) W. Where S is affine that is linear in rho, so one step from
any guess is exact on a plane; the cell beside is a good guess elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from covista_service.compiled import compiled
from covista_service.perception.camera import Camera, Floats
from covista_service.perception.sightlines import in_cells, project
from covista_service.perception.surface import COLUMNS, ROWS, Surface, stacked
from covista_service.perception.visibility import Seeing

_AHEAD = 1e-9
# A second step is taken where the first has moved the place in the old image by more than so much of a cell.
_STEPS, _SETTLED = 2, 0.1
# A surface is extended by so many times the inverse depth of a plane parallel to the image, and not into itself.
_LEAST, _MOST, _STEEPEST = 0.2, 5.0, 0.8
# So many cells beyond the old image, its border still tells what is there.
_MARGIN = 0.5
# What moved, or lies beside what was seen, by so many cells is surely less sure.
_FAR = COLUMNS / 4
_DOUBT, _MOST_DOUBT = 0.05, 0.3


def flow(seeings: Sequence[Seeing], rotations: Floats, translations: Floats, to: Sequence[Camera]) -> list[Surface]:
    """The surface of each camera as it looks from elsewhere, for X_2 = R X_1 + t and the cameras `to` that are there.

    `rotations` (n, 3, 3), `translations` (n, 3) m. What the old image does not show is as deep as what is seen beside
    it; where nothing is seen again, all is as deep as the old view's median. Sigma grows with the way that the image
    moves by, and towards what the old image does not show. Without motion everything stays as it is.
    """
    former, later = (_in_cells(cameras) for cameras in ([one.camera for one in seeings], to))
    found = _flow(
        np.ascontiguousarray(rotations, np.float64).reshape(-1, 3, 3),
        np.ascontiguousarray(translations, np.float64).reshape(-1, 3),
        former[0],
        later[1],
        *stacked([one.surface for one in seeings]),
    )
    # Copies: a surface that is kept must not keep all that were made with it.
    return [Surface(depth.copy(), sigma.copy()) for depth, sigma in zip(*found, strict=True)]


def _in_cells(cameras: Sequence[Camera]) -> tuple[Floats, Floats, Floats]:
    matrices = np.array([camera.matrix for camera in cameras], np.float64).reshape(-1, 3, 3)
    return in_cells(matrices, np.array([(one.width, one.height) for one in cameras], np.float64).reshape(-1, 2))


@compiled
def _flow(
    rotations: Floats,
    translations: Floats,
    cells_from_rays: Floats,
    rays_from_cells: Floats,
    inverse_depth: Floats,
    sigma: Floats,
) -> tuple[Floats, Floats]:
    """Inverse depths and sigmas (n, ROWS, COLUMNS) after the motions."""
    depths, sigmas = np.empty(inverse_depth.shape), np.empty(inverse_depth.shape)
    back, shift, forms = np.empty((3, 3)), np.empty(3), np.empty((5, 4))
    for k in range(len(rotations)):
        # X_1 = R' X_2 - R' t.
        for a in range(3):
            shift[a] = 0.0
            for b in range(3):
                back[a, b] = rotations[k, b, a]
                shift[a] -= rotations[k, b, a] * translations[k, b]
        project(back, shift, cells_from_rays[k], rays_from_cells[k], forms)
        if _seek(forms, inverse_depth[k], sigma[k], depths[k], sigmas[k]):
            _extend(depths[k], sigmas[k])
        else:
            depths[k], sigmas[k] = np.median(inverse_depth[k]), _MOST_DOUBT
    return depths, sigmas


@compiled
def _seek(forms: Floats, rho: Floats, sigma: Floats, depth: Floats, doubt: Floats) -> bool:
    """Find cell by cell what the old image shows, 0 where it does not; False if nowhere."""
    beside, some = rho[ROWS // 2, COLUMNS // 2], False
    for r in range(ROWS):
        u0, v0, w0 = (
            forms[0, 1] * r + forms[0, 2],
            forms[1, 1] * r + forms[1, 2],
            forms[2, 1] * r + forms[2, 2],
        )
        for c in range(COLUMNS):
            here, u, v = _met(forms, u0 + forms[0, 0] * c, v0 + forms[1, 0] * c, w0 + forms[2, 0] * c, beside, rho)
            depth[r, c] = here
            if here > 0:
                some, beside = True, here
                way = (u - c - 0.5) * (u - c - 0.5) + (v - r - 0.5) * (v - r - 0.5)
                i, j = min(max(int(v), 0), ROWS - 1), min(max(int(u), 0), COLUMNS - 1)
                doubt[r, c] = _less_sure(sigma[i, j], _DOUBT * min(np.sqrt(way) / _FAR, 1.0))
    return some


@compiled
def _met(forms: Floats, u0: float, v0: float, w0: float, guess: float, rho: Floats) -> tuple[float, float, float]:
    """Inverse depth along the ray of a cell, and where that lies in the old image; 0 where that shows nothing of it."""
    u, v = 0.0, 0.0
    for _ in range(_STEPS):
        w = w0 + forms[2, 3] * guess
        if w <= _AHEAD:
            return 0.0, u, v
        nearness = 1 / w
        u, v = (u0 + forms[0, 3] * guess) * nearness, (v0 + forms[1, 3] * guess) * nearness
        x, y = min(max(u - 0.5, 0.0), COLUMNS - 1.0), min(max(v - 0.5, 0.0), ROWS - 1.0)
        j, i = min(int(x), COLUMNS - 2), min(int(y), ROWS - 2)
        upper, lower = rho[i, j + 1] - rho[i, j], rho[i + 1, j + 1] - rho[i + 1, j]
        top, bottom = rho[i, j] + (x - j) * upper, rho[i + 1, j] + (x - j) * lower
        here = top + (y - i) * (bottom - top)
        # Constant beyond the outermost centres.
        across = upper + (y - i) * (lower - upper) if x == u - 0.5 else 0.0
        down = bottom - top if y == v - 0.5 else 0.0
        level = here - across * u - down * v
        steep = level * forms[2, 3] + across * forms[0, 3] + down * forms[1, 3]
        parallel = here * w
        met = (level * w0 + across * u0 + down * v0) / (1 - steep) if steep < _STEEPEST else parallel
        if not _LEAST * parallel < met < _MOST * parallel:
            met = parallel
        off = abs(forms[0, 3] - u * forms[2, 3]) + abs(forms[1, 3] - v * forms[2, 3])
        off *= nearness * abs(met - guess)
        guess = met
        if off < _SETTLED:
            break
    if max(max(-u, u - COLUMNS), max(-v, v - ROWS)) > _MARGIN:
        return 0.0, u, v
    return guess, u, v


@compiled
def _extend(depth: Floats, sigma: Floats) -> None:
    """Fill what was not found with the nearest found in its row, and rows without any with the nearest row."""
    first, last = -1, -1
    for r in range(ROWS):
        if _extend_row(depth[r], sigma[r]):
            first, last = (r if first < 0 else first), r
    for r in range(ROWS):
        # Rows between others have what those have: the old image is convex, and so is what is seen of it.
        near = min(max(r, first), last)
        while depth[near, 0] <= 0:
            near -= 1
        if near != r:
            for c in range(COLUMNS):
                depth[r, c] = depth[near, c]
                sigma[r, c] = _less_sure(sigma[near, c], _MOST_DOUBT * min(abs(r - near) / _FAR, 1.0))


@compiled
def _extend_row(depth: Floats, sigma: Floats) -> bool:
    """Fill a row from what was found in it, from the left and from the right; False if nothing was."""
    last = -1
    for c in range(COLUMNS):
        if depth[c] > 0:
            for gap in range(last + 1, c):
                near = c if last < 0 or c - gap < gap - last else last
                depth[gap] = depth[near]
                sigma[gap] = _less_sure(sigma[near], _MOST_DOUBT * min(abs(gap - near) / _FAR, 1.0))
            last = c
    for gap in range(last + 1 if last >= 0 else COLUMNS, COLUMNS):
        depth[gap] = depth[last]
        sigma[gap] = _less_sure(sigma[last], _MOST_DOUBT * min((gap - last) / _FAR, 1.0))
    return last >= 0


@compiled
def _less_sure(sigma: float, doubt: float) -> float:
    """Sigma grown by doubt, to no more than is to be said of anything, unless it was more before."""
    return float(min(np.sqrt(sigma * sigma + doubt * doubt), max(_MOST_DOUBT, sigma)))
