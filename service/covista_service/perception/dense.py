"""A dense surface: depth in every pixel of a thumbnail by plane sweep, kept where another keyframe confirms it.

In three steps, so that a keyframe which comes later costs one sweep: `neighbours` to hold against, `sweep`, `surface`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from covista_service.perception.agreement import SINGLE, DepthPoints
from covista_service.perception.camera import Camera, Floats, Pose, View, relative
from covista_service.perception.confirmation import confirmed
from covista_service.perception.neighbours import NeighbourOptions, best_neighbours
from covista_service.perception.scene import Scene
from covista_service.perception.smoothing import SmoothingOptions, lowest, smoothed
from covista_service.perception.surface import Surface, SurfaceOptions, interpolate
from covista_service.perception.sweep import LEAST_SIDE, Beside, Glimpse, glimpse, likeness
from covista_service.perception.visibility import Seeing

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class DenseOptions:
    """Sweeps `planes` inverse depths: those of the agreed points, 2nd to 98th percentile, made `farther` and `nearer`.

    `noise` is that of the thumbnail in grey levels. Near the agreed points, within `reach` image widths, leaving their
    surface by more than `room` and a plane costs `prior`. A pixel stays if its likeness is at least `least_likeness`
    and another keyframe's depth is the same within `tolerance` and a plane, and that holds for the share `company` of
    the 5 x 5 pixels around: chance comes alone. A keyframe with fewer than `least_points` agreed points, or a smaller
    share of such pixels than `least_share`, keeps its interpolated surface.
    """

    planes: int = 32
    farther: float = 0.4
    nearer: float = 0.3
    noise: float = 2.0
    prior: float = 0.2
    room: float = 0.1
    reach: float = 0.02
    least_likeness: float = 0.4
    tolerance: float = 0.05
    company: float = 0.5
    least_points: int = 20
    least_share: float = 0.05
    neighbours: NeighbourOptions = field(default_factory=NeighbourOptions)
    smoothing: SmoothingOptions = field(default_factory=SmoothingOptions)
    surface: SurfaceOptions = field(default_factory=SurfaceOptions)


@dataclass(frozen=True, slots=True, eq=False)
class Keyframe:
    """A view with its adjusted pose, agreed points and interpolated surface; `glimpse`, if its thumbnail is of use."""

    view: View
    pose: Pose
    points: DepthPoints
    surface: Surface | None
    glimpse: Glimpse | None


@dataclass(frozen=True, slots=True, eq=False)
class DepthMap:
    """`inverse_depth` and `likeness` (h, w) of a thumbnail's pixels; `step`, the distance of the planes, 1/m."""

    inverse_depth: Floats
    likeness: NDArray[np.float32]
    step: float


def densified(scene: Scene, options: DenseOptions) -> Scene:
    """The scene with dense surfaces, where there are thumbnails and neighbours to sweep."""
    keyframes = [
        Keyframe(view, pose, points, known, _glimpse(view))
        for view, pose, points, known in zip(scene.views, scene.poses, scene.points, scene.surfaces, strict=True)
    ]
    beside: list[list[int]] = []
    for k, keyframe in enumerate(keyframes):
        candidates = [int(j) for j in np.flatnonzero(scene.parts == scene.parts[k]) if j != k]
        best = neighbours(keyframe, [keyframes[j] for j in candidates], options)
        beside.append([candidates[j] for j in best])
    maps = [
        sweep(keyframe, [keyframes[j] for j in others], options)
        for keyframe, others in zip(keyframes, beside, strict=True)
    ]
    surfaces = [
        surface(keyframe, mine, [(keyframes[j], theirs) for j in others if (theirs := maps[j]) is not None], options)
        for keyframe, mine, others in zip(keyframes, maps, beside, strict=True)
    ]
    return scene.with_surfaces(surfaces)


def neighbours(keyframe: Keyframe, candidates: Sequence[Keyframe], options: DenseOptions) -> list[int]:
    """Which of the candidates to sweep against, best first."""
    if keyframe.surface is None:
        return []
    usable = [
        (k, Seeing(one.view.camera, one.surface), *relative(keyframe.pose, one.pose))
        for k, one in enumerate(candidates)
        if one.glimpse is not None and one.surface is not None
    ]
    here = Seeing(keyframe.view.camera, keyframe.surface)
    best = best_neighbours(
        here, [(seeing, rotation, shift) for _, seeing, rotation, shift in usable], options.neighbours
    )
    return [usable[k][0] for k in best]


def sweep(keyframe: Keyframe, others: Sequence[Keyframe], options: DenseOptions) -> DepthMap | None:
    """Depth in every pixel; None where there is nothing to sweep, or no range to sweep it over."""
    mine, known = keyframe.glimpse, keyframe.surface
    beside = [
        Beside(other.glimpse, *relative(keyframe.pose, other.pose)) for other in others if other.glimpse is not None
    ]
    if mine is None or known is None or not beside or len(keyframe.points) < options.least_points:
        return None
    low, high = np.percentile(keyframe.points.inverse_depths, (2, 98))
    planes = np.linspace(low / (1 + options.farther), high * (1 + options.nearer), options.planes)
    step = float(planes[1] - planes[0])
    alike = likeness(mine, beside, planes, options.noise)
    costs = np.float32(0.5) - np.float32(0.5) * alike + _prior(keyframe, known, planes, mine.grey.shape, options)
    labels = lowest(smoothed(np.ascontiguousarray(np.moveaxis(costs, 0, -1)), mine.grey, options.smoothing))
    nearest = np.rint(labels).astype(np.intp)
    return DepthMap(planes[0] + step * labels, np.take_along_axis(alike, nearest[None], axis=0)[0], step)


def surface(
    keyframe: Keyframe, mine: DepthMap | None, others: Sequence[tuple[Keyframe, DepthMap]], options: DenseOptions
) -> Surface | None:
    """Through the agreed points and the pixels that another map confirms; the interpolated one where few are."""
    if mine is None or keyframe.glimpse is None:
        return keyframe.surface
    kept = np.zeros(mine.inverse_depth.shape, np.bool_)
    for other, theirs in others:
        if other.glimpse is not None:
            beside = Beside(other.glimpse, *relative(keyframe.pose, other.pose))
            room = options.tolerance, theirs.step
            kept |= confirmed(keyframe.glimpse, beside, mine.inverse_depth, theirs.inverse_depth, *room)
    kept &= mine.likeness >= options.least_likeness
    kept &= cv2.blur(kept.astype(np.float32), (5, 5)) >= options.company
    if kept.mean() < options.least_share:
        return keyframe.surface
    return interpolate(_joined(keyframe, mine, kept), keyframe.view.camera, options.surface, keyframe.view.thumbnail)


def _glimpse(view: View) -> Glimpse | None:
    if view.thumbnail is None or min(view.thumbnail.shape) < LEAST_SIDE:
        return None
    return glimpse(view.thumbnail, view.camera)


def _prior(
    keyframe: Keyframe, known: Surface, planes: Floats, shape: tuple[int, ...], options: DenseOptions
) -> NDArray[np.float32]:
    """What each plane costs (L, h, w) for being off the interpolated surface; less, the further the points."""
    height, width = shape
    expected = cv2.resize(known.inverse_depth, (width, height), interpolation=cv2.INTER_LINEAR).astype(np.float32)
    camera = keyframe.view.camera
    px = (keyframe.points.positions_px + 0.5) * (width / camera.width, height / camera.height)
    column, row = np.clip(px, 0, (width - 1, height - 1)).astype(np.intp).T
    away = np.ones((height, width), np.uint8)
    away[row, column] = 0
    distance = cv2.distanceTransform(away, cv2.DIST_L2, 3)
    reach = (options.reach * width) ** 2
    weight = np.asarray(options.prior * reach / (distance**2 + reach), np.float32)
    room = np.float32(options.room) * expected + np.float32(planes[1] - planes[0])
    off = np.abs(planes.astype(np.float32)[:, None, None] - expected) / room
    return np.asarray(weight * np.minimum(off, np.float32(1)), np.float32)


def _joined(keyframe: Keyframe, mine: DepthMap, kept: Mask) -> DepthPoints:
    """Agreed points, and the kept pixels, each worth as much as a point that was seen once."""
    points = keyframe.points
    px = _pixel_centres(keyframe.view.camera, kept.shape)[kept]
    return DepthPoints(
        np.concatenate((points.positions_px, px)),
        np.concatenate((points.inverse_depths, mine.inverse_depth[kept])),
        np.concatenate((points.sigmas, np.full(len(px), mine.step / 4))),
        np.concatenate((points.confidences, np.full(len(px), SINGLE))),
    )


def _pixel_centres(camera: Camera, shape: tuple[int, ...]) -> Floats:
    """Where the pixels (h, w, 2) of a thumbnail lie in the image."""
    height, width = shape
    x = (np.arange(width) + 0.5) * camera.width / width - 0.5
    y = (np.arange(height) + 0.5) * camera.height / height - 0.5
    return np.stack(np.meshgrid(x, y), axis=-1)
