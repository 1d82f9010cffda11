"""Which planes are worth telling: description length of a cloud of points by planes.

Clouds are arrays (4, n) of x, y, rho and px per unit of inverse depth, as in `fuzzy`; `neighbours` (n, k) are the
points next to each in the image. Told are the planes, which of them each point lies on, given its neighbours' planes,
and how far off it lies. Planes that chance lays through outliers have their points scattered among others', which is
dear to tell; a true plane's lie together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from covista_service.compiled import compiled
from covista_service.perception.camera import Floats
from covista_service.perception.fuzzy import fit

Labels = NDArray[np.int64]
OUTLIER = -1


class Terms(NamedTuple):
    """Nats for each `plane` and each `outlier`; points on a plane scatter by `noise_px`.

    A plane needs `min_support` points whose smaller extent is more than `thinnest` of the larger one.
    """

    plane: float
    outlier: float
    noise_px: float
    min_support: int
    thinnest: float


@compiled
def costs(cloud: Floats, planes: Floats, terms: Terms) -> Floats:
    """Nats (K, n) to tell where each point is on each plane c (K, 3)."""
    nats = np.empty((len(planes), cloud.shape[1]))
    scale = 0.5 / (terms.noise_px * terms.noise_px)
    for k in range(len(planes)):
        a, b, c = planes[k]
        for i in range(cloud.shape[1]):
            away = (a * cloud[0, i] + b * cloud[1, i] + c - cloud[2, i]) * cloud[3, i]
            nats[k, i] = away * away * scale
    return nats


@compiled
def assign(cloud: Floats, planes: Floats, terms: Terms) -> tuple[Labels, float]:
    """The plane (n,) that tells each point's place in the fewest nats, -1 for none; and the nats of all."""
    nats = costs(cloud, planes, terms)
    labels = np.full(cloud.shape[1], OUTLIER)
    told = 0.0
    for i in range(cloud.shape[1]):
        least = terms.outlier
        for k in range(len(planes)):
            if nats[k, i] < least:
                least, labels[i] = nats[k, i], k
        told += least
    return labels, told


@compiled
def length(cloud: Floats, neighbours: Labels, planes: Floats, terms: Terms) -> float:
    """Nats to tell planes c (K, 3), and where all points are."""
    labels, told = assign(cloud, planes, terms)
    kinds = len(planes) + 1
    n, k = neighbours.shape
    for i in range(n):
        alike = 0
        for j in neighbours[i]:
            alike += labels[j] == labels[i]
        told -= np.log((alike + 1.0 / kinds) / (k + 1.0))
    return float(told + terms.plane * len(planes) + n * np.log(terms.noise_px))


@compiled
def chosen(cloud: Floats, proposed: Floats, terms: Terms, most: int) -> Floats:
    """Up to `most` planes (K, 3) out of many, each in turn the one that shortens the description most."""
    nats = costs(cloud, proposed, terms)
    remaining = np.full(cloud.shape[1], terms.outlier)
    picked = np.empty((most, 3))
    for count in range(most):
        best, largest = -1, terms.plane
        for k in range(len(proposed)):
            gain = 0.0
            for i in range(cloud.shape[1]):
                gain += max(remaining[i] - nats[k, i], 0.0)
            if gain > largest:
                best, largest = k, gain
        if best < 0:
            return picked[:count]
        picked[count] = proposed[best]
        remaining = np.minimum(remaining, nats[best])
    return picked


@compiled
def pruned(cloud: Floats, neighbours: Labels, planes: Floats, terms: Terms, refits: int) -> tuple[Floats, float]:
    """Planes refitted to their own points, without those that do not pay for themselves; and the nats to tell all.

    The last one stays: `chosen` has found it worth telling, and among few points no labels tell much.
    """
    planes = refitted(cloud, planes, terms, refits)
    least = length(cloud, neighbours, planes, terms)
    while len(planes) > 1:
        shortest, fewer = np.inf, planes
        for k in range(len(planes)):
            rest = refitted(cloud, np.concatenate((planes[:k], planes[k + 1 :])), terms, refits)
            without = length(cloud, neighbours, rest, terms)
            if without < shortest:
                shortest, fewer = without, rest
        if shortest > least:
            break
        planes, least = fewer, shortest
    return planes, least


@compiled
def refitted(cloud: Floats, planes: Floats, terms: Terms, refits: int) -> Floats:
    """Planes fitted to the points assigned to them; those with too few points, or with points on a line, are gone."""
    before = np.full(cloud.shape[1], OUTLIER)
    for _ in range(refits):
        labels, _told = assign(cloud, planes, terms)
        if (labels == before).all():
            break
        weights = np.zeros((len(planes), cloud.shape[1]))
        for i in range(cloud.shape[1]):
            if labels[i] >= 0:
                weights[labels[i], i] = 1.0
        kept = 0
        fitted = fit(cloud, weights)
        for k in range(len(planes)):
            if _is_plane(cloud, weights[k], terms):
                fitted[kept] = fitted[k]
                kept += 1
        before = labels if kept == len(planes) else np.full(cloud.shape[1], OUTLIER)
        planes = fitted[:kept]
    return planes


@compiled
def _is_plane(cloud: Floats, weights: Floats, terms: Terms) -> bool:
    """Has a cluster with hard `weights` (n,) enough points, spread over an area?"""
    support = weights.sum()
    if support < terms.min_support:
        return False
    x = y = xx = xy = yy = 0.0
    for i in range(cloud.shape[1]):
        w, px, py = weights[i] / support, cloud[0, i], cloud[1, i]
        x, y = x + w * px, y + w * py
        xx, xy, yy = xx + w * px * px, xy + w * px * py, yy + w * py * py
    xx, xy, yy = xx - x * x, xy - x * y, yy - y * y
    half, gap = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    return bool(half - gap > terms.thinnest * terms.thinnest * (half + gap))
