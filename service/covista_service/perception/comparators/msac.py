"""Planes by sequential MSAC (Torr and Zisserman, CVIU 2000), stopped by the same description length as ours."""

from __future__ import annotations

import numpy as np

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats
from covista_service.perception.description import OUTLIER, Labels, Terms, costs, length, refitted
from covista_service.perception.fuzzy import Points
from covista_service.perception.planes import FoundPlanes, PlaneOptions, by_support, neighbours, terms_of
from covista_service.perception.seeding import through

# Enough to draw three points of one plane with 99.9 % probability where 24 % of the points are its own.
SAMPLES = 500


def find_planes(points: Points, options: PlaneOptions, seed: int, samples: int = SAMPLES) -> FoundPlanes:
    """Planes of n points, strongest first; K may be 0."""
    if len(points) < options.min_support:
        return FoundPlanes(np.zeros((0, 3)), np.full(len(points), OUTLIER))
    cloud, beside = points.cloud, neighbours(points, options.neighbours)
    draws = np.random.default_rng(seed).random((options.fuzzy.max_clusters, samples, 3))
    told = []
    for noise_px in options.noise_px:
        terms = terms_of(noise_px, options)
        told.append((*_sequence(cloud, beside, draws, terms, options.refits), terms))
    planes, _, terms = min(told, key=lambda one: one[1])
    return by_support(cloud, planes, terms)


@compiled
def _sequence(cloud: Floats, beside: Labels, draws: Floats, terms: Terms, refits: int) -> tuple[Floats, float]:
    """Planes c (K, 3), each the best of its samples on the points that those before it left, while they pay."""
    planes = np.empty((len(draws), 3))
    left = cloud
    least = length(cloud, beside, planes[:0], terms)
    for count in range(len(draws)):
        plane = refitted(left, _best(left, draws[count], terms), terms, refits)
        if not len(plane):
            return planes[:count], least
        planes[count] = plane[0]
        told = length(cloud, beside, planes[: count + 1], terms)
        if told >= least:
            return planes[:count], least
        least = told
        left = left[:, costs(left, plane, terms)[0] >= terms.outlier]
    return planes, least


@compiled
def _best(cloud: Floats, draws: Floats, terms: Terms) -> Floats:
    """The plane (0 | 1, 3) through three points that shortens the description most."""
    best, largest = np.empty((1, 3)), 0.0
    for draw in draws:
        fixed, a, b, c = through(cloud, draw)
        if not fixed:
            continue
        gain = 0.0
        for i in range(cloud.shape[1]):
            away = (a * cloud[0, i] + b * cloud[1, i] + c - cloud[2, i]) * cloud[3, i] / terms.noise_px
            gain += max(terms.outlier - 0.5 * away * away, 0.0)
        if gain > largest:
            largest = gain
            best[0] = a, b, c
    return best[: int(largest > 0)]
