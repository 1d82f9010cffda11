"""Table I and Figs. 2 to 4: planes, inlier points and overlapped pixels of the three scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from covista_clients.simulation import truth
from numpy.typing import NDArray

from covista_service.drawing import canvas, plots
from covista_service.evaluation import methods, pictures
from covista_service.evaluation.paper.chapter import Chapter, Item, Tell
from covista_service.evaluation.paper.likeness import CAMERA, TABLE_1, Likeness, likeness, strongest
from covista_service.evaluation.rendered import case_of
from covista_service.perception.camera import Floats
from covista_service.perception.survey import Outcome, Survey, SurveyOptions, survey

TOLERANCE_PERCENT = 2.0
# Of the pixels of a pair's pictures, how many must be drawn as they are.
LEAST_RIGHT = 0.95
_FEWEST = 8
_STEP_PX = 4


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """A scene by the paper's method with as many inlier points as it had (`few`) and with all features (`full`).

    `surface` is q_1 by surfaces, with all features.
    """

    scene: Likeness
    few: Survey
    full: Survey
    surface: float | None


def common_field(tell: Tell, names: Sequence[str] = tuple(TABLE_1)) -> Chapter:
    """The chapter of Table I, over the scenes named."""
    rows: list[Row] = []
    for name in names:
        tell(f"Table I: {name}")
        rows.append(_row(likeness(name)))
    drawn = {_file_name(row): _picture(row) for row in rows}
    return Chapter(tuple(item for row in rows for item in _items(row)), {"table_1.png": _table(rows), **drawn})


def _row(scene: Likeness) -> Row:
    few = _with_inliers(scene, TABLE_1[scene.name].inliers)
    case = case_of(scene.views, [(0, 1)])
    surface = methods.METHODS["auto"](case)[0, 1].overlap_a
    return Row(scene, few, case.surveys[0, 1].survey, surface)


def _with_inliers(scene: Likeness, wanted: int) -> Survey:
    """What as few of each image's strongest features say as leave `wanted` inlier points."""
    most = max(len(view.features.keypoints_px) for view in scene.views)
    found = Survey(Outcome.FEW_MATCHES)
    for count in range(max(wanted, _FEWEST), most + 1):
        one, other = (strongest(view, count) for view in scene.views)
        found = survey(one, other, SurveyOptions())
        if found.outcome is Outcome.MEASURED and found.inliers >= wanted:
            return found
    return found


def _items(row: Row) -> list[Item]:
    name, printed = row.scene.name, TABLE_1[row.scene.name]
    few, full = _percent(row.few.overlap_first), _percent(row.full.overlap_first)
    surface, true = _percent(row.surface), 100 * row.scene.truth[0]
    right = _drawn_right(row)
    near = f"within {TOLERANCE_PERCENT:g} points of the true {true:.2f} %"
    table = partial(Item, "Table I")
    return [
        table(f"{name}: detected planes", printed.planes, len(row.few.planes), len(row.few.planes) == printed.planes),
        table(
            f"{name}: inlier points, with as many of the strongest features as leave so many",
            printed.inliers,
            row.few.inliers,
            row.few.inliers == printed.inliers,
        ),
        table(
            f"{name}: overlapped pixels of image 1, %",
            printed.overlap_percent,
            few,
            _near(few, printed.overlap_percent),
        ),
        Item(
            "Table I, all features",
            f"{name}: {printed.planes} plane{'s' * (printed.planes > 1)}, overlapped pixels of image 1 {near}",
            None,
            full,
            len(row.full.planes) == printed.planes and _near(full, true),
        ),
        Item(
            "Table I, surfaces",
            f"{name}: overlapped pixels of image 1 {near}",
            None,
            surface,
            _near(surface, true),
        ),
        Item(
            printed.figure,
            f"{name}: at least {LEAST_RIGHT:.0%} of both images' pixels are drawn as they truly are",
            None,
            round(right, 4),
            right >= LEAST_RIGHT,
        ),
    ]


def _near(ours: float | None, percent: float) -> bool:
    return ours is not None and abs(ours - percent) <= TOLERANCE_PERCENT


def _percent(share: float | None) -> float | None:
    return None if share is None else round(100 * share, 2)


def _drawn_right(row: Row) -> float:
    """Share of both images' pixels that the regions call common or not, as they truly are."""
    world, (one, other) = row.scene.world, row.scene.poses
    _, seen_first = truth.common(world, CAMERA, one, CAMERA, other, _STEP_PX)
    _, seen_second = truth.common(world, CAMERA, other, CAMERA, one, _STEP_PX)
    drawn_first = _inside([plane.region_first for plane in row.few.planes])
    drawn_second = _inside([plane.region_second for plane in row.few.planes])
    return float(np.concatenate([drawn_first == seen_first, drawn_second == seen_second]).mean())


def _inside(regions_px: Sequence[Floats]) -> NDArray[np.bool_]:
    """Which of the pixels that the truth is asked for lie in one of the regions."""
    mask = canvas.mask_of((CAMERA.height, CAMERA.width), regions_px)
    x, y = truth.pixels(CAMERA, _STEP_PX).astype(int).T
    return np.asarray(mask[y, x] > 127, np.bool_)


def _picture(row: Row) -> bytes:
    images = [cv2.imencode(".png", rendering.image)[1].tobytes() for rendering in row.scene.renderings]
    captions = [
        f"{row.scene.name}, image {k + 1}: {_percent(overlap):.2f} % common by planes, {100 * true:.2f} % truly"
        if overlap is not None
        else f"{row.scene.name}, image {k + 1}: {row.few.outcome}"
        for k, (overlap, true) in enumerate(
            zip((row.few.overlap_first, row.few.overlap_second), row.scene.truth, strict=True)
        )
    ]
    return pictures.pair(row.scene.views, (images[0], images[1]), row.few, (captions[0], captions[1]))


def _file_name(row: Row) -> str:
    number = TABLE_1[row.scene.name].figure.removeprefix("Fig. ")
    return f"fig_{number}_{row.scene.name.lower()}.png"


def _table(rows: Sequence[Row]) -> bytes:
    heads = (
        "scene",
        "planes,\nprinted",
        "planes,\nours",
        "inliers,\nprinted",
        "inliers,\nours",
        "overlap,\nprinted",
        "overlap,\nours",
        "overlap,\ntrue",
        "planes,\nall features",
        "overlap,\nall features",
        "overlap,\nsurfaces",
    )
    return plots.table(
        "Table I: planes, inlier points, and overlapped pixels of image 1", heads, [_cells(row) for row in rows]
    )


def _cells(row: Row) -> tuple[str, ...]:
    printed = TABLE_1[row.scene.name]
    return (
        row.scene.name,
        str(printed.planes),
        str(len(row.few.planes)),
        str(printed.inliers),
        str(row.few.inliers),
        f"{printed.overlap_percent:.2f} %",
        _text(_percent(row.few.overlap_first)),
        f"{100 * row.scene.truth[0]:.2f} %",
        str(len(row.full.planes)),
        _text(_percent(row.full.overlap_first)),
        _text(_percent(row.surface)),
    )


def _text(percent: float | None) -> str:
    return "-" if percent is None else f"{percent:.2f} %"
