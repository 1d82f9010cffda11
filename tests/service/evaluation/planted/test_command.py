from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path

import pytest
import typer
from covista_service.evaluation.planted import mover
from covista_service.evaluation.planted import run as runs
from covista_service.evaluation.planted.command import planted
from covista_service.evaluation.planted.methods import METHODS
from typer.testing import CliRunner

APP = typer.Typer()
APP.command()(planted)
TINY = ["--first-seed", "1008", "--seeds", "2", "--rendered", "0", "--drives", "0"]


def test_json_stands_alone_on_stdout_and_progress_beside_it() -> None:
    result = CliRunner().invoke(APP, [*TINY, "--format", "json"])
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    assert found["setting"] == {"seeds": 2, "first_seed": 1008, "largest": 200, "rendered": 0, "drives": 0}
    assert {(each["variant"], each["method"]) for each in found["figures"]} == {
        (variant, method) for variant in runs.VARIANTS for method in METHODS
    }
    assert len(found["trials"]) == 2 * len(runs.VARIANTS) * len(METHODS)
    assert all(-1 <= trial["ari"] <= 1 and trial["ms"] > 0 for trial in found["trials"])
    assert "seed 1009" in result.stderr


def test_the_table_names_every_method() -> None:
    result = CliRunner().invoke(APP, TINY)
    assert result.exit_code == 0, result.stderr
    assert all(name in result.stdout for name in (*METHODS, *runs.VARIANTS, "6-12", "mean", "wall"))
    assert "…" not in result.stdout
    # No swarm of these seeds is so large.
    assert "81-200" not in result.stdout


def test_a_folder_gets_the_figures_and_two_plots_of_every_variant(tmp_path: Path) -> None:
    out = tmp_path / "new"
    result = CliRunner().invoke(APP, [*TINY, "--out", str(out)])
    assert result.exit_code == 0, result.stderr
    pictures = {f"{variant}_{what}.png" for variant in runs.VARIANTS for what in ("by_size", "spread")}
    assert {path.name for path in out.iterdir()} == pictures | {"planted.json"}
    assert all((out / name).read_bytes().startswith(b"\x89PNG") for name in pictures)
    assert len(json.loads((out / "planted.json").read_text())["trials"]) == 2 * len(runs.VARIANTS) * len(METHODS)


def test_movers_have_a_table_and_a_plot_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "rows", partial(mover.rows, settings=mover.SETTINGS[-1:]))
    monkeypatch.setattr(runs, "_LIVE", {"adaptive": (10,), "gain": (10,)})
    arguments = ["--first-seed", "1008", "--seeds", "1", "--rendered", "0", "--drives", "1", "--out", str(tmp_path)]
    result = CliRunner().invoke(APP, arguments)
    assert result.exit_code == 0, result.stderr
    assert "a noisy mover" in result.stdout
    assert (tmp_path / "mover.png").read_bytes().startswith(b"\x89PNG")
    rows = json.loads((tmp_path / "planted.json").read_text())["movers"]
    assert [row["criterion"] for row in rows] == ["adaptive", "gain"]
    assert all(row["others_per_100"] <= row["changes_per_100"] for row in rows)


def test_the_same_seeds_give_the_same_figures() -> None:
    options = runs.RunOptions(seeds=2, first_seed=5, rendered=0)
    one, other = ([trial.ari for trial in runs.run(options)] for _ in range(2))
    assert one == other


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--seeds", "0"], "--seeds"),
        (["--first-seed", "-1"], "--first-seed"),
        (["--largest", "50"], "--largest"),
        (["--rendered", "-1"], "--rendered"),
        (["--format", "xml"], "--format"),
    ],
)
def test_options_that_make_no_sense_are_named(arguments: list[str], complaint: str) -> None:
    result = CliRunner().invoke(APP, arguments)
    assert result.exit_code == 2
    assert complaint in result.stderr
    assert not result.stdout


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = CliRunner().invoke(APP, [*TINY, "--out", str(tmp_path / "file" / "out")])
    assert result.exit_code == 1
    assert len(result.stderr.splitlines()) == 1
    assert "cannot be made a folder" in result.stderr


def test_without_matplotlib_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = CliRunner().invoke(APP, [*TINY, "--out", str(tmp_path / "out")])
    assert result.exit_code == 1
    assert len(result.stderr.splitlines()) == 1
    assert "covista[bench]" in result.stderr
    assert not (tmp_path / "out").exists()
