from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import typer
from covista_service.evaluation.paper import run as runs
from covista_service.evaluation.paper.chapter import Chapter, Experiment, Item
from covista_service.evaluation.paper.command import paper
from covista_service.evaluation.paper.common_field import common_field
from covista_service.evaluation.paper.correlation import CAMERA, Sample, correlation
from covista_service.evaluation.paper.invariance import FLAT, invariance
from typer.testing import CliRunner

from tests.service.evaluation.pngs import size_of

APP = typer.Typer()
APP.command()(paper)
FIELDS = {"item", "case", "printed", "ours", "agrees"}
QUICK: Mapping[str, Experiment] = {
    "common field": partial(common_field, names=("Floor",)),
    "invariance": partial(invariance, names=("Floor",), scales=(0.1, 1.0, 10.0)),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]], list[str]]:
    """The floor alone, and three baselines: the folder, paper.json, and what was told on the way."""
    out, told = tmp_path_factory.mktemp("paper") / "new", list[str]()
    runs.run(out, QUICK, told.append)
    return out, json.loads((out / "paper.json").read_text()), told


def test_every_line_has_the_fields_and_either_a_print_or_a_law(written: tuple[Path, list[Any], list[str]]) -> None:
    _, lines, told = written
    assert all(set(line) == FIELDS for line in lines)
    assert all(line["agrees"] in (True, False) and line["case"] for line in lines)
    assert {line["item"] for line in lines if line["printed"] is not None} == {"Table I"}
    assert {"Table I", "Fig. 3"} <= {line["item"] for line in lines}
    assert told


def test_the_floor_has_two_planes_and_the_overlap_that_is_printed(written: tuple[Path, list[Any], list[str]]) -> None:
    _, lines, _ = written
    rows = {line["case"].partition(": ")[2].partition(",")[0]: line for line in lines if line["item"] == "Table I"}
    assert rows["detected planes"]["ours"] == rows["detected planes"]["printed"] == 2
    assert rows["inlier points"]["ours"] == rows["inlier points"]["printed"] == 37
    assert rows["overlapped pixels of image 1"]["printed"] == 91.28
    assert rows["overlapped pixels of image 1"]["ours"] == pytest.approx(91.28, abs=2)
    assert all(line["agrees"] for line in lines)


def test_the_length_of_the_baseline_does_not_matter_and_mixing_two_does(
    written: tuple[Path, list[Any], list[str]],
) -> None:
    _, lines, _ = written
    laws = [line for line in lines if line["item"].startswith("Invariance")]
    assert len(laws) == 4
    assert all(line["ours"] <= FLAT for line in laws if "matches" in line["case"])
    (mixed,) = (line for line in laws if "another baseline" in line["case"])
    assert mixed["ours"] > 0.05


def test_every_table_and_figure_is_a_picture(written: tuple[Path, list[Any], list[str]]) -> None:
    out, _, _ = written
    names = {path.name for path in out.glob("*.png")}
    assert names == {"table_1.png", "fig_3_floor.png", "invariance.png"}
    assert size_of(out / "fig_3_floor.png")[0] > 1200


def test_the_common_field_is_drawn_where_it_is(written: tuple[Path, list[Any], list[str]]) -> None:
    """Of image 1 the left edge is what the other camera, which stands to the right, does not see."""
    picture = cv2.imread(str(written[0] / "fig_3_floor.png"))
    assert picture is not None
    assert picture[:470, :20].mean() < 0.6 * picture[:470, 300:340].mean()


def test_measures_are_correlated_over_the_pairs_of_worlds() -> None:
    chapter = correlation(lambda _: None, [("wall", 0)])
    cases = [item.case for item in chapter.items]
    assert any(case.startswith("Pearson, all pairs: auto") for case in cases)
    assert any(case.startswith("Spearman, overlap >= 0.1: auto") for case in cases)
    assert all(item.printed is None and -1 <= float(item.ours or 0) <= 1 for item in chapter.items)
    assert set(chapter.pictures) == {"correlation.png", "correlation_table.png"}
    assert (CAMERA.width, CAMERA.height) == (320, 240)


def test_a_measure_that_says_the_same_of_all_pairs_measures_nothing() -> None:
    true = np.linspace(0, 1, 5)
    found = Sample("all pairs", true, {"same": np.full(5, 0.5), "right": true}).correlations
    assert (found["same"].pearson, found["same"].spearman) == (0.0, 0.0)
    assert (found["right"].pearson, found["right"].spearman) == (pytest.approx(1), pytest.approx(1))


def test_the_command_sums_up_and_counts_what_agrees(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    items = (Item("Table I", "one", 1, 1, agrees=True), Item("Ours", "a law", None, 0.5, agrees=False))
    monkeypatch.setattr(
        runs, "EXPERIMENTS", {"one": lambda tell: tell("on the way") or Chapter(items, {"a.png": b"a"})}
    )
    result = CliRunner().invoke(APP, ["--out", str(tmp_path)])
    assert result.exit_code == 0
    assert "1 of 2 agree" in result.stdout
    assert "on the way" in result.stderr
    assert (tmp_path / "a.png").read_bytes() == b"a"
    assert json.loads((tmp_path / "paper.json").read_text())[1] == {
        "item": "Ours",
        "case": "a law",
        "printed": None,
        "ours": 0.5,
        "agrees": False,
    }


def test_without_matplotlib_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = CliRunner().invoke(APP, ["--out", str(tmp_path / "out")])
    assert result.exit_code == 1
    assert "covista[bench]" in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()
