"""What an evaluation found, as pictures: `covista-station evaluate --figures FOLDER`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from covista_service.drawing import plots
from covista_service.evaluation import pictures
from covista_service.evaluation.case import Case, Pair
from covista_service.evaluation.datasets import Dataset
from covista_service.evaluation.files import make_folder
from covista_service.evaluation.run import Evaluation
from covista_service.perception.camera import Floats
from covista_service.perception.survey import Outcome

_TRUTH = "true share of the image that the other camera sees"
_ANSWER = "share as answered"
_ERROR = "|answered - true share|"


def write_set(folder: Path, dataset: Dataset, evaluations: Sequence[Evaluation]) -> None:
    """Plots of all `evaluations` of a set, and its overlays: SET_scatter.png, SET_errors.png, SET_overlay_A_B.png."""
    make_folder(folder)
    answers = _answers(dataset, evaluations)
    name = _file_name(dataset.name)
    if any(len(truth) for truth, _ in answers.values()):
        panels = [_panel(method, *found) for method, found in answers.items()]
        _write(folder / f"{name}_scatter.png", plots.scatters(panels, dataset.name, _TRUTH, _ANSWER))
        errors = {method: np.abs(given - truth) for method, (truth, given) in answers.items()}
        title = f"{dataset.name}\nerror over ordered pairs"
        _write(folder / f"{name}_errors.png", plots.boxes(errors, title, _ERROR))
    for (a, b), picture in _overlays(dataset, evaluations[0].case).items():
        ids = (_file_name(dataset.frames[k].id) for k in (a, b))
        _write(folder / f"{name}_overlay_{'_'.join(ids)}.png", picture)


def write_overview(folder: Path, evaluations: Sequence[Evaluation]) -> None:
    """Mean errors of every method on every set, and over all sets: errors.png."""
    sets = list(dict.fromkeys(each.dataset for each in evaluations))
    methods = list(dict.fromkeys(each.method for each in evaluations))
    means = {method: [_mean_error(evaluations, method, name) for name in sets] for method in methods}
    if len(sets) > 1:
        means = {method: [*row, _mean(row)] for method, row in means.items()}
        sets.append("mean")
    make_folder(folder)
    title = "Mean error of the overlap (no answer counts as 0)"
    _write(folder / "errors.png", plots.bars(sets, means, title, f"mean of {_ERROR}"))


def _answers(dataset: Dataset, evaluations: Sequence[Evaluation]) -> dict[str, tuple[Floats, Floats]]:
    """By method: truth (n,) and answers (n,) over ordered pairs with a defined truth, all seeds; no answer is 0."""
    index = {frame.id: k for k, frame in enumerate(dataset.frames)}
    rows: dict[str, list[tuple[float, float]]] = {each.method: [] for each in evaluations}
    for each in evaluations:
        for a, b, answer in each.pairs:
            for i, j, overlap in ((a, b, answer.overlap_a), (b, a, answer.overlap_b)):
                rows[each.method].append((float(dataset.truth[index[i], index[j]]), overlap or 0.0))
    found = {method: np.array(pairs, np.float64).reshape(-1, 2) for method, pairs in rows.items()}
    defined = {method: pairs[np.isfinite(pairs[:, 0])] for method, pairs in found.items()}
    return {method: (pairs[:, 0], pairs[:, 1]) for method, pairs in defined.items()}


def _panel(method: str, truth: Floats, given: Floats) -> plots.Panel:
    return plots.Panel(f"{method}: mean error {np.abs(given - truth).mean():.3f}", truth, given)


def _overlays(dataset: Dataset, case: Case) -> Mapping[Pair, bytes]:
    """The planes of three measured pairs: those with the greatest, the middle and the least true overlap."""
    if case.views is None:
        return {}
    both = (dataset.truth + dataset.truth.T) / 2
    measured = [
        pair
        for pair, timed in case.surveys.items()
        if timed.survey.outcome is Outcome.MEASURED and np.isfinite(both[pair])
    ]
    ranked = sorted(measured, key=lambda pair: float(both[pair]))
    chosen = dict.fromkeys(ranked[k] for k in (-1, len(ranked) // 2, 0)) if ranked else {}
    return {pair: _overlay(dataset, case, pair) for pair in chosen}


def _overlay(dataset: Dataset, case: Case, pair: Pair) -> bytes:
    if case.views is None:
        raise ValueError("a set without cameras has no overlays")
    found = case.surveys[pair].survey
    a, b = pair
    captions = [
        f"{dataset.frames[i].id}: seen by {dataset.frames[j].id} {overlap or 0.0:.1%} (planes), "
        f"{dataset.truth[i, j]:.1%} (true)"
        for i, j, overlap in ((a, b, found.overlap_first), (b, a, found.overlap_second))
    ]
    images = (dataset.frames[a].image.read_bytes(), dataset.frames[b].image.read_bytes())
    return pictures.pair((case.views[a], case.views[b]), images, found, (captions[0], captions[1]))


def _mean_error(evaluations: Sequence[Evaluation], method: str, dataset: str) -> float | None:
    return _mean([each.metrics.mae for each in evaluations if (each.method, each.dataset) == (method, dataset)])


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _file_name(text: str) -> str:
    return re.sub(r"[^\w.-]+", "-", text)


def _write(path: Path, picture: bytes) -> None:
    path.write_bytes(picture)
