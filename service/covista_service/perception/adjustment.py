"""Poses that agree across pairs: keyframes whose reported poses the images contradict are adjusted together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from covista_service.perception.bundle import BundleOptions, Poses, Prior, Tracks, bundle
from covista_service.perception.camera import Camera, Floats, Pose
from covista_service.perception.skeleton import unfold

Pair = tuple[int, int]


@dataclass(frozen=True, slots=True)
class AdjustmentOptions:
    """How far off reported poses are taken to be, where images contradict them.

    `rotation_deg`; `position_share` of the median depth of what a keyframe sees. `pair_rotation_deg` is how well a
    pair's images tell its rotation. Keyframes that nobody contradicts stay.
    """

    rotation_deg: float = 9.0
    position_share: float = 0.03
    pair_rotation_deg: float = 0.2
    rounds: int = 20
    bundle: BundleOptions = field(default_factory=BundleOptions)


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """What the images of a verified pair say: `matches` (k, 2) keypoint indices, X_2 = R X_1 + t.

    `contradicts`: the images have told another pose than was reported.
    """

    matches: NDArray[np.int64]
    rotation: Floats
    translation: Floats
    contradicts: bool


@dataclass(frozen=True, slots=True, eq=False)
class Sighted:
    """A keyframe: camera, reported pose, keypoints (n, 2) in ideal px, and the median depth of what it sees, metres.

    One that is `held` stays where it is, whoever contradicts it; a `firm` one only for another.
    """

    camera: Camera
    pose: Pose
    keypoints_px: Floats
    depth_m: float
    held: bool = False
    firm: bool = False


def adjust(keyframes: Sequence[Sighted], links: Mapping[Pair, Link], options: AdjustmentOptions) -> list[Pose]:
    """The poses of all keyframes, adjusted where links contradict them; the others exactly as reported."""
    free = to_adjust(keyframes, links)
    if not free.any():
        return [keyframe.pose for keyframe in keyframes]
    reported = _poses([keyframe.pose for keyframe in keyframes])
    depths = np.array([keyframe.depth_m for keyframe in keyframes])
    held = np.array([[1e8, 1e8]]) / np.column_stack((np.ones(len(depths)), depths**2))
    loose = np.column_stack(
        (np.full(len(depths), np.radians(options.rotation_deg) ** -2.0), (options.position_share * depths) ** -2.0)
    )
    prior = Prior(reported, np.where(free[:, None], loose, held), free)
    rotations = averaged_rotations(prior, links, options)
    # A pair without a baseline has no direction to place anyone by.
    ties = {pair: link for pair, link in links.items() if link.translation.any()}
    centres = unfold(
        [(keyframe.camera, keyframe.keypoints_px) for keyframe in keyframes], rotations, reported.centres, ties
    )
    start = Poses(rotations, np.where(free[:, None], centres, reported.centres))
    found = bundle(start, prior, tracks(keyframes, links), options.bundle)
    return [
        Pose(found.rotations[k], found.centres[k]) if free[k] else keyframe.pose for k, keyframe in enumerate(keyframes)
    ]


def to_adjust(keyframes: Sequence[Sighted], links: Mapping[Pair, Link]) -> NDArray[np.bool_]:
    """Which keyframes (n,) are to be adjusted: both of a pair that contradicts what was reported, unless it is held.

    Where others bear out but one of the two, the other alone.
    """
    free = np.zeros(len(keyframes), np.bool_)
    for (i, j), link in links.items():
        if link.contradicts:
            free[i] |= not keyframes[i].firm or keyframes[j].firm
            free[j] |= not keyframes[j].firm or keyframes[i].firm
    return free & ~np.array([keyframe.held for keyframe in keyframes], np.bool_)


def averaged_rotations(prior: Prior, links: Mapping[Pair, Link], options: AdjustmentOptions) -> Floats:
    """World_from_camera (K, 3, 3) that fit the links' rotations best, each link under Cauchy's loss of one degree."""
    rotations = prior.poses.rotations.copy()
    count = len(rotations)
    trust = np.radians(options.pair_rotation_deg) ** -2.0
    for _ in range(options.rounds):
        off = _turns(prior.poses.rotations @ rotations.transpose(0, 2, 1))
        system = np.kron(np.diag(prior.information[:, 0]), np.eye(3))
        right = prior.information[:, :1] * off
        for (i, j), link in links.items():
            gap = _turns(rotations[i] @ link.rotation.T @ rotations[j].T)
            weight = trust / (1 + float(gap @ gap) / np.radians(1.0) ** 2)
            tie = np.zeros((count, count))
            tie[[i, j], [i, j]], tie[[i, j], [j, i]] = weight, -weight
            system += np.kron(tie, np.eye(3))
            right[i] -= weight * gap
            right[j] += weight * gap
        step = np.linalg.solve(system, right.ravel()).reshape(-1, 3)
        rotations = Rotation.from_rotvec(step).as_matrix() @ rotations
        if np.abs(step).max() < 1e-6:
            break
    return rotations


def tracks(keyframes: Sequence[Sighted], links: Mapping[Pair, Link]) -> Tracks:
    """Points as chains of matches; a chain that comes to one keyframe twice is none."""
    offsets = np.cumsum([0, *(len(keyframe.keypoints_px) for keyframe in keyframes)])
    ends = np.concatenate([link.matches + offsets[list(pair)] for pair, link in links.items()])
    total = int(offsets[-1])
    graph = coo_array((np.ones(len(ends), np.int64), (ends[:, 0], ends[:, 1])), shape=(total, total))
    point = connected_components(graph, directed=False)[1]
    node = np.unique(ends)
    keyframe = np.searchsorted(offsets, node, side="right") - 1
    order = np.lexsort((keyframe, point[node]))
    node, keyframe = node[order], keyframe[order]
    owner = point[node]
    twice = owner[1:][(owner[1:] == owner[:-1]) & (keyframe[1:] == keyframe[:-1])]
    kept = ~np.isin(owner, twice)
    node, keyframe, owner = node[kept], keyframe[kept], owner[kept]
    keypoints = np.concatenate([one.keypoints_px for one in keyframes])
    matrices = np.array([one.camera.matrix for one in keyframes])[keyframe]
    focal = np.column_stack((matrices[:, 0, 0], matrices[:, 1, 1]))
    rays = (keypoints[node] - matrices[:, :2, 2]) / focal
    starts = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1], True]) if len(owner) else np.zeros(1, np.int64)
    return Tracks(starts.astype(np.int64), keyframe.astype(np.int64), rays, np.ascontiguousarray(focal[:, 0]))


def _poses(poses: Sequence[Pose]) -> Poses:
    return Poses(np.array([pose.world_from_camera for pose in poses]), np.array([pose.centre_m for pose in poses]))


def _turns(rotations: Floats) -> Floats:
    return np.asarray(Rotation.from_matrix(rotations).as_rotvec(), np.float64)
