"""Section II-C: the overlap by planes does not depend on the length of the baseline.

As long as what is triangulated with a baseline is projected back with the same one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from covista_clients.simulation import truth
from covista_clients.simulation.viewing import world_from_camera

from covista_service.drawing import plots
from covista_service.evaluation.paper.chapter import Chapter, Item, Tell
from covista_service.evaluation.paper.likeness import CAMERA, TABLE_1, Likeness, likeness
from covista_service.perception.camera import Features, Floats, Pose, View
from covista_service.perception.overlap import common_field
from covista_service.perception.survey import Survey, SurveyOptions, survey

NAME = "Invariance under the baseline's length"
SCALES: tuple[float, ...] = tuple(np.logspace(-1, 1, 21).tolist())
FLAT = 1e-9
NOISE_PX = 0.5
WRONG_SHARE = 0.1
# What another baseline must change at least, or there would be nothing to be invariant against.
TELLING = 0.05
_STEP_PX = 24


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """q_1 by planes (n,) over the baseline's scale; `apart`: with that baseline triangulated, with the true one cut."""

    matches: str
    q: Floats
    apart: Floats


def invariance(tell: Tell, names: Sequence[str] = tuple(TABLE_1), scales: Sequence[float] = SCALES) -> Chapter:
    """The chapter: every scene with exact, noisy and rendered matches, over baselines scaled by `scales`."""
    sweeps: dict[str, list[Sweep]] = {}
    for name in names:
        tell(f"{NAME}: {name}")
        sweeps[name] = [_sweep(kind, views, scales) for kind, views in _matches(likeness(name)).items()]
    items = [item for name, found in sweeps.items() for item in _items(name, found, scales)]
    return Chapter(tuple(items), {"invariance.png": _plot(sweeps, scales)})


def _matches(scene: Likeness) -> dict[str, tuple[View, View]]:
    exact = _exact(scene)
    return {"exact": exact, "noisy": _noisy(exact, np.random.default_rng(0)), "rendered": scene.views}


def _exact(scene: Likeness) -> tuple[View, View]:
    """Both views with features at the true places of the same surface points, and descriptors that tell them apart."""
    one, other = scene.poses
    _, seen = truth.common(scene.world, CAMERA, one, CAMERA, other, _STEP_PX)
    first_px = truth.pixels(CAMERA, _STEP_PX)[seen]
    x, y = first_px.astype(int).T
    surface_m = truth.lifted(CAMERA, one, first_px, 1 / scene.renderings[0].depth_m[y, x].astype(np.float64))
    across, along, depth = ((surface_m - np.array(other.position_m)) @ world_from_camera(other)).T
    second_px = np.column_stack([CAMERA.fx * across / depth + CAMERA.cx, CAMERA.fy * along / depth + CAMERA.cy])
    descriptors = np.random.default_rng(0).integers(0, 90, (len(first_px), 128), dtype=np.uint8)
    first, second = (
        replace(view, features=Features("rootsift", points.astype(np.float32), descriptors))
        for view, points in zip(scene.views, (first_px, second_px), strict=True)
    )
    return first, second


def _noisy(exact: tuple[View, View], rng: np.random.Generator) -> tuple[View, View]:
    """The same features with errors of `NOISE_PX`, a share of them matched with somebody else's."""
    count = len(exact[0].features.keypoints_px)
    swapped = np.arange(count)
    wrong = rng.permutation(count)[: round(WRONG_SHARE * count)]
    swapped[wrong] = np.roll(wrong, 1)
    views = []
    for view, order in zip(exact, (np.arange(count), swapped), strict=True):
        points = view.features.keypoints_px + rng.normal(0, NOISE_PX, (count, 2))
        kept = Features("rootsift", points.astype(np.float32), view.features.descriptors[order])
        views.append(replace(view, features=kept))
    return views[0], views[1]


def _sweep(matches: str, views: tuple[View, View], scales: Sequence[float]) -> Sweep:
    first, second = views
    base = second.pose.centre_m - first.pose.centre_m
    surveys = []
    for scale in scales:
        moved = Pose(second.pose.world_from_camera, first.pose.centre_m + scale * base)
        surveys.append(survey(first, replace(second, pose=moved), SurveyOptions()))
    q = np.array([_overlap(found.overlap_first) for found in surveys])
    apart = np.array([_apart(views, found, scale) for found, scale in zip(surveys, scales, strict=True)])
    return Sweep(matches, q, apart)


def _overlap(q: float | None) -> float:
    return 0.0 if q is None else q


def _apart(views: tuple[View, View], found: Survey, scale: float) -> float:
    """q_1 when planes that were triangulated with a scaled baseline are projected back with the true one."""
    normals = np.array([plane.normal for plane in found.planes]).reshape(-1, 3)
    first, second = views
    field = common_field(first.camera, second.camera, found.rotation, found.translation / scale, normals)
    return field.overlap_first


def _items(name: str, sweeps: Sequence[Sweep], scales: Sequence[float]) -> list[Item]:
    span = f"w = {min(scales):g} ... {max(scales):g}"
    items = []
    for sweep in sweeps:
        flat = float(np.ptp(sweep.q))
        case = f"{name}, {sweep.matches} matches: q(w) keeps within {FLAT:g} for {span}"
        items.append(Item(NAME, case, None, flat, flat <= FLAT and bool(sweep.q.min() > 0)))
    change = float(np.ptp(sweeps[0].apart))
    case = f"{name}, projected back with another baseline: q(w) changes by more than {TELLING:g} for {span}"
    return [*items, Item(NAME, case, None, round(change, 4), change > TELLING)]


def _plot(sweeps: dict[str, list[Sweep]], scales: Sequence[float]) -> bytes:
    x: Floats = np.array(scales)
    panels = {
        name: [
            *(plots.Curve(f"{sweep.matches} matches", x, sweep.q) for sweep in found),
            plots.Curve("exact matches, projected back with the true baseline", x, found[0].apart),
        ]
        for name, found in sweeps.items()
    }
    title = "Overlap by planes when the baseline is taken w times as long"
    return plots.curves(panels, title, "scale w of the baseline", "q of image 1")
