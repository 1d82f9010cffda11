"""What one camera sees of another's surface: what lies in its image, with nothing of its own surface before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats
from covista_service.perception.sightlines import in_cells, look, ranges
from covista_service.perception.surface import COLUMNS, ROWS, Surface, stacked

Mask = NDArray[np.bool_]
# Of keyframes that matches connect.
SAME_SCALE = (1.0, 1.0)
# What may be wrong about a count of cells, each a share of all cells. `apart`: by how much of their inverse depth the
# two surfaces differ, over cells where they show the same; `before`: the same over cells that stand before all that
# the other camera saw there. `hidden`: cells taken to be hidden. `inner_edge`, `outer_edge`: cells seen near the other
# image's border, and cells that just miss it.
CLUES = ("apart", "before", "hidden", "inner_edge", "outer_edge")


@dataclass(frozen=True, slots=True)
class VisibilityOptions:
    """A point is hidden if the other camera's surface is nearer by `tolerance` of its inverse depth plus sigma.

    And by more than `parallax_px` in the image, or tiny baselines would turn noise into occlusions. Between keyframes
    that no chain of matches connects, depths have scales of their own: there the median ratio is taken out, as far as
    `scale_sigmas` of those scales allow, and `unconnected_tolerance` holds. Up to `edge` image widths from its border
    is near to it. Nothing is seen from behind: from `beyond` times as far behind a surface as the first camera stands
    before it, for the slope of a surface is not exact.
    """

    tolerance: float = 0.05
    parallax_px: float = 4.0
    unconnected_tolerance: float = 0.25
    scale_sigmas: float = 3.0
    edge: float = 0.05
    beyond: float = 0.8


@dataclass(frozen=True, slots=True, eq=False)
class Seeing:
    """A camera and what it sees: its surface."""

    camera: Camera
    surface: Surface


@dataclass(frozen=True, slots=True, eq=False)
class Gallery:
    """Cameras and their surfaces, stacked, so that many pairs of them can be read in one pass.

    Images are measured in cells: `cells_from_rays` (m, 3, 3) take (X, Y, Z) to column and row, `rays_from_cells`
    (m, 3, 3) the indices of a cell to the ray of its centre, and `cell_px` (m, 2) is how wide and high a cell is.
    `inverse_depth` and `sigma` (m, ROWS, COLUMNS) as in a surface; `range_of_row` (m, ROWS, 2): the least and greatest
    inverse depth of a row of cells.
    """

    cells_from_rays: Floats
    rays_from_cells: Floats
    cell_px: Floats
    inverse_depth: Floats
    sigma: Floats
    range_of_row: Floats

    @classmethod
    def of(cls, seeings: Sequence[Seeing]) -> Gallery:
        """Stack them; a pair names its two by their places in this order."""
        matrix = np.array([one.camera.matrix for one in seeings], np.float64).reshape(-1, 3, 3)
        size = np.array([(one.camera.width, one.camera.height) for one in seeings], np.float64).reshape(-1, 2)
        depth, sigma = stacked([one.surface for one in seeings])
        return cls(*in_cells(matrix, size), depth, sigma, ranges(depth))


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """What many ordered pairs see: `shares` q (n,) of Eq. 16, and the `clues` (n, 5) of each, in the order of CLUES."""

    shares: Floats
    clues: Floats


def seen(
    first: Seeing,
    second: Seeing,
    rotation: Floats,
    translation: Floats,
    options: VisibilityOptions,
    *,
    ratios: tuple[float, float] = SAME_SCALE,
) -> Mask:
    """Which cells (ROWS, COLUMNS) of the first image the second camera sees, for X_2 = R X_1 + t.

    Their share is q of Eq. 16. `ratios`: for keyframes that matches do not connect, the least and greatest ratio that
    the scales of their depths may have.
    """
    pair = np.array([[0, 1]])
    masks = seen_masks(
        Gallery.of((first, second)), pair, rotation[None], translation[None], np.array([ratios]), options
    )
    return np.asarray(masks[0], np.bool_)


def seen_shares(
    gallery: Gallery,
    pairs: NDArray[np.integer],
    rotations: Floats,
    translations: Floats,
    ratios: Floats,
    options: VisibilityOptions,
) -> Floats:
    """Shares q (n,) of Eq. 16 for ordered pairs (n, 2) of the gallery: the mean of `seen`, many times faster.

    `rotations` (n, 3, 3) and `translations` (n, 3) m say X_2 = R X_1 + t for each pair, `ratios` (n, 2) as for `seen`.
    """
    return _look(gallery, pairs, rotations, translations, ratios, options, 1, weigh=False)[0]


def looks(
    gallery: Gallery,
    pairs: NDArray[np.integer],
    rotations: Floats,
    translations: Floats,
    ratios: Floats,
    options: VisibilityOptions,
) -> Looks:
    """The same with what may be wrong about each share."""
    shares, _, clues = _look(gallery, pairs, rotations, translations, ratios, options, 1, weigh=True)
    return Looks(shares, clues)


def seen_masks(
    gallery: Gallery,
    pairs: NDArray[np.integer],
    rotations: Floats,
    translations: Floats,
    ratios: Floats,
    options: VisibilityOptions,
) -> Mask:
    """Which cells (n, ROWS, COLUMNS) of the first image of each pair its second camera sees."""
    return _look(gallery, pairs, rotations, translations, ratios, options, len(pairs), weigh=False)[1]


def _look(
    gallery: Gallery,
    pairs: NDArray[np.integer],
    rotations: Floats,
    translations: Floats,
    ratios: Floats,
    options: VisibilityOptions,
    masks: int,
    *,
    weigh: bool,
) -> tuple[Floats, Mask, Floats]:
    """Shares, and as many masks as asked for: with fewer than pairs, only the shares are of use. Clues, if weighed."""
    seen = np.empty((masks, ROWS, COLUMNS), np.bool_)
    clues = np.empty((len(pairs) if weigh else 0, len(CLUES)))
    counts = look(
        np.ascontiguousarray(pairs, np.int64).reshape(-1, 2),
        np.ascontiguousarray(rotations, np.float64).reshape(-1, 3, 3),
        np.ascontiguousarray(translations, np.float64).reshape(-1, 3),
        np.ascontiguousarray(ratios, np.float64).reshape(-1, 2),
        gallery.cells_from_rays,
        gallery.rays_from_cells,
        gallery.cell_px,
        gallery.inverse_depth,
        gallery.sigma,
        gallery.range_of_row,
        np.array(
            [options.tolerance, options.parallax_px**2, options.unconnected_tolerance, options.edge, options.beyond]
        ),
        seen,
        clues,
    )
    return counts / (ROWS * COLUMNS), seen, clues
