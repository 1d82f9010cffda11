from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import typer
from covista_service.evaluation.command import evaluate
from typer.testing import CliRunner

from tests.service.evaluation import recording

APP = typer.Typer()
APP.command()(evaluate)
PAIR_FIELDS = {"a", "b", "overlap_a", "overlap_b", "interval_a", "interval_b", "found_by", "inliers", "planes", "ms"}
SHARES = {"rank_correlation", "found_share", "interval_coverage", "interval_width"}
METRICS = {"pairs", "mae", "mae_found", "ms_median"} | SHARES


def run(*arguments: str) -> Any:
    result = CliRunner().invoke(APP, [*arguments, "--format", "json"])
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def test_a_plane_is_measured_and_written_as_json_alone(tmp_path: Path) -> None:
    folder = recording.write(tmp_path / "plane", (0, 80, 160))
    planes, frustum = run(str(folder), "--method", "planes", "--method", "frustum")
    assert set(planes) == {"dataset", "method", "input", "pose_noise", "seed", "pairs", "metrics"}
    assert (planes["dataset"], planes["method"], frustum["method"]) == ("plane", "planes", "frustum")
    assert (planes["input"], planes["pose_noise"], planes["seed"]) == ("images", [0, 0], 0)
    assert [(pair["a"], pair["b"]) for pair in planes["pairs"]] == [("f0", "f1"), ("f0", "f2"), ("f1", "f2")]
    assert all(set(pair) >= PAIR_FIELDS and pair["outcome"] for pair in planes["pairs"])
    assert all(set(each["metrics"]) == METRICS for each in (planes, frustum))
    assert all(each["metrics"]["pairs"] == 6 for each in (planes, frustum))
    assert planes["metrics"]["mae"] < 0.02
    assert frustum["metrics"]["mae"] < 0.02
    assert planes["metrics"]["rank_correlation"] > 0.8


@pytest.mark.parametrize("given", ["images", "features", "features+thumbnails"])
def test_surfaces_are_the_default_and_hold_under_pose_noise(tmp_path: Path, given: str) -> None:
    folder = str(recording.write(tmp_path / "plane", (0, 80, 160)))
    (exact,) = run(folder, "--input", given)
    assert exact["method"] == "auto"
    (noisy,) = run(folder, "--method", "surface", "--input", given, "--pose-noise", "3,0.03")
    assert exact["metrics"]["mae"] < 0.02
    assert noisy["metrics"]["mae"] < 0.05
    assert {pair["found_by"] for pair in exact["pairs"]} == {"image"}
    assert all(pair["inliers"] > 50 for pair in exact["pairs"])
    for pair in exact["pairs"]:
        for side in "ab":
            low, high = pair[f"interval_{side}"]
            assert 0 <= low <= pair[f"overlap_{side}"] <= high <= 1
    assert exact["metrics"]["interval_coverage"] > 0.8
    assert exact["metrics"]["interval_width"] < 0.1


def test_seeds_repeat_and_noise_is_told(tmp_path: Path) -> None:
    folder = str(recording.write(tmp_path / "plane"))
    arguments = (folder, "--method", "frustum", "--pose-noise", "3,0.03", "--seeds", "2", "--features", "orb")
    first, again = run(*arguments), run(*arguments)
    assert [each["seed"] for each in first] == [0, 1]
    assert first[0]["pose_noise"] == [3, 0.03]
    overlaps = [[pair["overlap_a"] for pair in each["pairs"]] for each in first]
    assert overlaps == [[pair["overlap_a"] for pair in each["pairs"]] for each in again]
    assert overlaps[0] != overlaps[1]


def test_a_set_without_cameras_is_answered_pair_by_pair() -> None:
    folder = recording.shared("graf_oxford")
    (found,) = run(str(folder))
    assert len(found["pairs"]) == 15
    assert {pair["outcome"] for pair in found["pairs"]} == {"no_camera"}
    assert found["metrics"]["found_share"] == 0
    assert found["metrics"]["mae"] > 0.5


def test_a_bad_folder_ends_with_one_line(tmp_path: Path) -> None:
    folder = recording.write(tmp_path / "plane", kind="film")
    result = CliRunner().invoke(APP, [str(folder)])
    assert result.exit_code == 1
    assert result.stdout == ""
    assert str(folder / "dataset.json") in result.stderr
    assert "kind" in result.stderr


@pytest.mark.parametrize("noise", ["3", "a,b", "-1,0", "0,nan"])
def test_noise_that_makes_no_sense_is_refused(tmp_path: Path, noise: str) -> None:
    folder = recording.write(tmp_path / "plane")
    assert CliRunner().invoke(APP, [str(folder), "--pose-noise", noise]).exit_code == 2


def test_a_table_is_for_people(tmp_path: Path) -> None:
    result = CliRunner().invoke(APP, [str(recording.write(tmp_path / "plane"))])
    assert result.exit_code == 0
    assert "plane" in result.stdout
    assert "found" in result.stdout


def test_pictures_are_not_written_into_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    result = CliRunner().invoke(APP, [str(tmp_path / "none"), "--figures", str(tmp_path / "file")])
    assert result.exit_code == 1
    assert "cannot be made a folder" in result.stderr
    assert (tmp_path / "file").read_text() == "mine"
