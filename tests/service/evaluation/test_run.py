from __future__ import annotations

from pathlib import Path

import pytest
from covista_service.evaluation.datasets import load
from covista_service.evaluation.run import RunOptions, evaluate, steps

from tests.service.evaluation import recording


@pytest.mark.parametrize("chosen", [("snavely",), ("hull", "planes"), ("planes", "frustum", "distance")])
@pytest.mark.parametrize("kind", ["rgbd", "homography"])
def test_progress_adds_up_whatever_is_asked(tmp_path: Path, chosen: tuple[str, ...], kind: str) -> None:
    dataset = load(recording.write(tmp_path / "plane", (0, 80, 160), kind=kind))
    options = RunOptions(methods=chosen, seeds=2)
    told: list[None] = []
    found = list(evaluate(dataset, options, lambda: told.append(None)))
    assert [(each.method, each.seed) for each in found] == [(name, seed) for seed in (0, 1) for name in chosen]
    assert len(told) == steps(dataset, options)


def test_images_alone_are_compared_without_cameras(tmp_path: Path) -> None:
    dataset = load(recording.write(tmp_path / "plane", (0, 80, 160), kind="homography"))
    snavely, coslam = evaluate(dataset, RunOptions(methods=("snavely", "coslam")))
    assert snavely.metrics.found_share == 1.0
    assert snavely.metrics.rank_correlation > 0.8
    assert coslam.metrics.found_share == 0.0
    assert {answer.outcome for _, _, answer in coslam.pairs} == {"no_camera"}
