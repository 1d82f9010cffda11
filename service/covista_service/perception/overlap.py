"""The common field of view of two cameras on known planes, as exact polygons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from covista_service.perception import polygon
from covista_service.perception.camera import Camera, Floats
from covista_service.perception.polygon import Polygon

# A camera closer to a plane than this share of the plane's distance from the other camera sees it edge-on.
EDGE_ON = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class CommonField:
    """Regions (polygons in px) of each plane that both cameras see, and q_1, q_2 of Eq. 16."""

    overlap_first: float
    overlap_second: float
    regions_first: tuple[Polygon, ...]
    regions_second: tuple[Polygon, ...]


def common_field(
    first: Camera,
    second: Camera,
    rotation: Floats,
    translation: Floats,
    normals: Floats,
    orders: tuple[Floats | None, Floats | None] = (None, None),
) -> CommonField:
    """What both cameras see of the planes u . X + 1 = 0, `normals` u (K, 3) in the first camera's frame, X_2 = R X + t.

    A pixel v of either image shows the plane whose row of its order (K, 3) gives the largest row . v; without an order
    the nearest, whose inverse depth is the largest. Every condition is linear in the pixel of the first image, so
    each plane's common region is one convex polygon there, and cutting before mapping never meets a horizon.
    """
    pixels_to_rays = first.rays_from_pixels
    homographies = homographies_of(first, second, rotation, translation, normals)
    rho_first = -normals @ pixels_to_rays
    rho_second, same_side = inverse_depths_second(second, rotation, translation, normals)
    order_first = rho_first if orders[0] is None else orders[0]
    order_second = rho_second if orders[1] is None else orders[1]
    regions_first: list[Polygon] = []
    regions_second: list[Polygon] = []
    for k, homography in enumerate(homographies):
        conditions = _conditions(k, homography, second, rho_first[k], order_first, order_second)
        image = polygon.rectangle(first.width, first.height) if same_side[k] else []
        region = polygon.cut(image, conditions)
        regions_first.append(region)
        regions_second.append(polygon.mapped(region, homography))
    return CommonField(
        _share(regions_first, first),
        _share(regions_second, second),
        tuple(regions_first),
        tuple(regions_second),
    )


def homographies_of(first: Camera, second: Camera, rotation: Floats, translation: Floats, normals: Floats) -> Floats:
    """H_k = K_2 (R - t u_k^T) K_1^-1 (K, 3, 3), not rescaled: (H_k v)_3 = Z_2 / Z_1."""
    homographies: Floats = (
        second.matrix @ (rotation - translation[:, None] * normals[:, None, :]) @ first.rays_from_pixels
    )
    return homographies


def inverse_depths_second(
    second: Camera, rotation: Floats, translation: Floats, normals: Floats
) -> tuple[Floats, list[bool]]:
    """Inverse depth (K, 3) of each plane as a linear function of the second image's pixel; does it show the same side?

    A plane that the second camera lies in covers nothing of its image.
    """
    centre = -rotation.T @ translation
    side = 1.0 + normals @ centre
    edge_on = np.abs(side) < EDGE_ON
    scale = np.where(edge_on, 0.0, 1.0 / np.where(edge_on, 1.0, side))
    rho = -(normals @ rotation.T) * scale[:, None] @ second.rays_from_pixels
    return rho, (side >= EDGE_ON).tolist()


def _conditions(
    k: int, homography: Floats, second: Camera, rho: Floats, order_first: Floats, order_second: Floats
) -> list[list[float]]:
    """What a pixel v of the first image must fulfil to show plane k in both images, each row . v >= 0."""
    others = np.arange(len(order_first)) != k
    x, y, w = homography
    rows = np.vstack(
        (
            rho,
            order_first[k] - order_first[others],
            x + 0.5 * w,
            (second.width - 0.5) * w - x,
            y + 0.5 * w,
            (second.height - 0.5) * w - y,
            (order_second[k] - order_second[others]) @ homography,
        )
    )
    conditions: list[list[float]] = rows.tolist()
    return conditions


def _share(regions: list[Polygon], camera: Camera) -> float:
    """N_o / N_p of Eq. 16."""
    return min(1.0, sum(polygon.area(region) for region in regions) / camera.pixels)
