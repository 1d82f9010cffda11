"""A first guess of where keyframes are: a tree of pairs, each as long as the points it shares with the last one say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from covista_service.perception.camera import Camera, Floats
from covista_service.perception.sightings import Sightings
from covista_service.perception.triangulation import TriangulationOptions, triangulate

Pair = tuple[int, int]
_LEAST_SHARED = 5
# A tree that lies across what was reported is not shrunk below this share of the reported extent.
_LEAST_SCALE = 0.3


class Tie(Protocol):
    """A pair that is held together: `matches` (k, 2) keypoints and the direction of t in X_2 = R X_1 + t."""

    @property
    def matches(self) -> NDArray[np.int64]:
        """Keypoint indices (k, 2)."""
        ...

    @property
    def translation(self) -> Floats:
        """Translation (3,), of any length but zero."""
        ...


def unfold(
    keyframes: Sequence[tuple[Camera, Floats]], rotations: Floats, reported: Floats, ties: Mapping[Pair, Tie]
) -> Floats:
    """Centres (K, 3): each connected part as the pairs' directions tell it, moved and scaled to what was reported.

    Strongest pairs first. Along the tree the depths of shared keypoints tie the lengths, or pairs would have scales of
    their own; epipolar lines are blind to the sign of t, so points must lie ahead.
    """
    centres = reported.copy()
    placed: dict[int, Floats] = {}
    order = sorted(ties, key=lambda pair: (-len(ties[pair].matches), pair))
    while remaining := [pair for pair in order if not placed.keys() & set(pair)]:
        part: dict[int, Floats] = {remaining[0][0]: np.zeros(3)}
        depths: dict[int, dict[int, float]] = {}
        while reaching := [pair for pair in order if (pair[0] in part) != (pair[1] in part)]:
            _grow(reaching[0], part, depths, keyframes, rotations, reported, ties[reaching[0]])
        members = sorted(part)
        centres[members] = _fitted(np.array([part[k] for k in members]), reported[members])
        placed.update(part)
    return centres


def _grow(
    pair: Pair,
    part: dict[int, Floats],
    depths: dict[int, dict[int, float]],
    keyframes: Sequence[tuple[Camera, Floats]],
    rotations: Floats,
    reported: Floats,
    tie: Tie,
) -> None:
    i, j = pair
    rotation = rotations[j].T @ rotations[i]
    direction, unit_depths, ahead = _unit_depths(pair, keyframes, rotation, tie)
    known, new = (0, 1) if i in part else (1, 0)
    seen = depths.get(pair[known], {})
    of_known = tie.matches[:, known].tolist()
    shared = [
        seen[k] / depth
        for k, depth, ok in zip(of_known, unit_depths[known].tolist(), ahead.tolist(), strict=True)
        if ok and k in seen
    ]
    length = float(np.median(shared)) if len(shared) >= _LEAST_SHARED else _reported_length(pair, part, reported)
    shift = -rotations[j] @ direction * length  # C_j - C_i
    part[pair[new]] = part[pair[known]] + (shift if known == 0 else -shift)
    for side in (0, 1):
        entries = depths.setdefault(pair[side], {})
        for k, depth in zip(
            tie.matches[ahead, side].tolist(), (unit_depths[side][ahead] * length).tolist(), strict=True
        ):
            entries.setdefault(k, depth)


def _unit_depths(
    pair: Pair, keyframes: Sequence[tuple[Camera, Floats]], rotation: Floats, tie: Tie
) -> tuple[Floats, tuple[Floats, Floats], NDArray[np.bool_]]:
    """Direction of t with its sign, depths of the matches in either camera for a baseline of 1, and which are ahead."""
    (first, first_px), (second, second_px) = keyframes[pair[0]], keyframes[pair[1]]
    sightings = Sightings(first, second, first_px[tie.matches[:, 0]], second_px[tie.matches[:, 1]])
    direction = tie.translation / np.linalg.norm(tie.translation)
    within = TriangulationOptions(reprojection_px=np.inf)
    both = [(sign * direction, triangulate(sightings, rotation, sign * direction, within)) for sign in (1.0, -1.0)]
    direction, points = max(both, key=lambda one: int(one[1].kept.sum()))
    return direction, (points.depths_first, points.depths_second), points.kept


def _reported_length(pair: Pair, part: Mapping[int, Floats], reported: Floats) -> float:
    """The reported baseline, in the scale of what has been placed."""
    length = float(np.linalg.norm(reported[pair[1]] - reported[pair[0]]))
    members = sorted(part)
    here, there = _extent(np.array([part[k] for k in members])), _extent(reported[members])
    return length * here / there if here > 0 and there > 0 else length


def _fitted(centres: Floats, reported: Floats) -> Floats:
    """Centres (k, 3) moved and scaled to lie where they were reported."""
    offsets, targets = centres - centres.mean(axis=0), reported - reported.mean(axis=0)
    squared = float((offsets * offsets).sum())
    if squared == 0:
        return reported
    least = _LEAST_SCALE * _extent(reported) / _extent(centres)
    scale = max(float((offsets * targets).sum()) / squared, least)
    return np.asarray(reported.mean(axis=0) + scale * offsets, np.float64)


def _extent(centres: Floats) -> float:
    return float(np.sqrt(((centres - centres.mean(axis=0)) ** 2).sum()))
