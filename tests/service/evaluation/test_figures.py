from __future__ import annotations

import sys
from pathlib import Path

import pytest
import typer
from covista_service.evaluation.command import evaluate
from typer.testing import CliRunner

from tests.service.evaluation import recording
from tests.service.evaluation.pngs import size_of

APP = typer.Typer()
APP.command()(evaluate)


def test_sets_are_plotted_method_by_method_with_overlays(tmp_path: Path) -> None:
    folders = [str(recording.write(tmp_path / name, (0, 80, 160))) for name in ("near", "far")]
    out = tmp_path / "new" / "figures"
    result = CliRunner().invoke(APP, [*folders, "--method", "planes", "--method", "frustum", "--figures", str(out)])
    assert result.exit_code == 0, result.stderr
    names = {path.name for path in out.iterdir()}
    plotted = {f"{name}_{kind}.png" for name in ("near", "far") for kind in ("scatter", "errors")}
    assert names >= plotted | {"errors.png", "near_overlay_f0_f1.png", "near_overlay_f0_f2.png"}
    assert all(min(size_of(out / name)) > 200 for name in names)
    width, height = size_of(out / "near_overlay_f0_f1.png")
    assert width > 2 * height


def test_names_of_frames_are_made_fit_for_files(tmp_path: Path) -> None:
    frames = [{**recording.frame(k, shift), "id": f"left/{k}"} for k, shift in enumerate((0, 80))]
    folder = recording.write(tmp_path / "plane", frames=frames)
    (folder / "overlap_gt.json").write_text('{"ids": ["left/0", "left/1"], "q": [[null, 0.75], [0.75, null]]}')
    result = CliRunner().invoke(APP, [str(folder), "--method", "planes", "--figures", str(tmp_path / "out")])
    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "out" / "plane_overlay_left-0_left-1.png").is_file()


def test_a_set_without_cameras_has_plots_and_no_overlay(tmp_path: Path) -> None:
    folder = recording.shared("graf_oxford")
    result = CliRunner().invoke(APP, [str(folder), "--figures", str(tmp_path)])
    assert result.exit_code == 0, result.stderr
    names = {"graf_oxford_scatter.png", "graf_oxford_errors.png", "errors.png"}
    assert {path.name for path in tmp_path.iterdir()} == names


def test_without_matplotlib_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    folder = recording.write(tmp_path / "plane")
    result = CliRunner().invoke(APP, [str(folder), "--figures", str(tmp_path / "out")])
    assert result.exit_code == 1
    assert result.stdout == ""
    assert "covista[bench]" in result.stderr
    assert len(result.stderr.splitlines()) == 1
