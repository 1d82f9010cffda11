from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import typer
from covista_service.evaluation.calibration import Trials, fit, fitted, intervals, joined, kind, left_out, reach
from covista_service.evaluation.calibration_command import calibrate
from covista_service.perception.certainty import TERMS
from typer.testing import CliRunner

from tests.service.evaluation import recording

APP = typer.Typer()
APP.command()(calibrate)
WEIGHTS = np.array([0.01, 2.0, 1.0, 0.3, 0.0])


def trials(count: int, seed: int = 0, kinds: int = 5) -> Trials:
    """Answers whose errors follow Laplace's density with the scales that `WEIGHTS` give."""
    random = np.random.default_rng(seed)
    clues = random.exponential([1.0, 0.01, 0.02, 0.1, 0.02], (count, len(TERMS)))
    clues[:, 0] = 1
    down, up = clues.copy(), clues.copy()
    down[:, 3], up[:, 2] = 0, 0
    below, above = down @ WEIGHTS, up @ WEIGHTS
    size = random.exponential(1.0, count)
    error = np.where(random.random(count) < above / (above + below), size * above, -size * below)
    names = np.array([f"set{k % kinds}x" for k in range(count)])
    # Far from 0 and 1, where nothing is cut off.
    overlap = np.full(count, 100.0)
    return Trials(names, overlap + error, overlap, down, up, np.ones(count, np.bool_), np.zeros(count, np.bool_))


def share_held(given: Trials, weights: np.ndarray, level: float, of: Trials) -> float:
    room = reach(of, weights, level)
    error = given.truth - given.overlap
    return float(((-room * given.down @ weights <= error) & (error <= room * given.up @ weights)).mean())


def test_the_weights_behind_errors_are_found() -> None:
    assert fitted(trials(20000)) == pytest.approx(WEIGHTS, rel=0.15, abs=0.05)


@pytest.mark.parametrize("level", [0.5, 0.8, 0.9, 0.95])
def test_new_answers_are_held_as_often_as_promised(level: float) -> None:
    seen, new = trials(2000), trials(4000, seed=1)
    assert share_held(new, fitted(seen), level, of=seen) == pytest.approx(level, abs=0.02)


def test_the_reach_is_the_conformal_quantile() -> None:
    few = trials(9)
    scores = np.abs(few.truth - few.overlap) / np.where(few.truth > few.overlap, few.up @ WEIGHTS, few.down @ WEIGHTS)
    assert reach(few, WEIGHTS, 0.9) == pytest.approx(scores.max())
    assert reach(few, WEIGHTS, 0.5) == pytest.approx(np.sort(scores)[4])


def test_wrong_weights_are_made_good_by_the_reach() -> None:
    seen, new = trials(2000), trials(4000, seed=1)
    assert share_held(new, np.array([1.0, 0, 0, 0, 0]), 0.9, of=seen) == pytest.approx(0.9, abs=0.02)


def test_a_set_is_judged_without_itself() -> None:
    good = trials(500, kinds=4)
    odd = trials(100, seed=3, kinds=1).only(np.ones(100, np.bool_))
    worse = Trials(
        np.full(100, "odd"),
        odd.overlap + 50 * (odd.truth - odd.overlap),
        *(getattr(odd, name) for name in Trials.__slots__[2:]),
    )
    both = joined((good, worse))
    here = both.kinds == "odd"
    weights = fitted(good)
    assert left_out(both)[0][:, here] == pytest.approx(intervals(worse, weights, reach(good, weights, 0.9)))


def test_the_fit_is_the_same_again() -> None:
    assert fit(trials(300)) == fit(trials(300))


def test_worlds_of_one_kind_go_together() -> None:
    assert (kind("boxes_3"), kind("boxes_12"), kind("tum_fr1_desk"), kind("sol1431")) == (
        "boxes",
        "boxes",
        "tum_fr1_desk",
        "sol1431",
    )


def test_the_command_fits_and_draws(tmp_path: Path) -> None:
    folders = [str(recording.write(tmp_path / name, (0, 60, 130))) for name in ("plane", "other")]
    result = CliRunner().invoke(APP, [*folders, "--figures", str(tmp_path / "figures")])
    assert result.exit_code == 0, result.stderr
    assert "plane" in result.stdout
    assert all(f"{name}: float = " in result.stdout for name in (*TERMS, "nine_in_ten"))
    assert (tmp_path / "figures" / "calibration.png").read_bytes()[:4] == b"\x89PNG"


def test_one_kind_of_set_cannot_be_left_out(tmp_path: Path) -> None:
    result = CliRunner().invoke(APP, [str(recording.write(tmp_path / "plane"))])
    assert result.exit_code == 1
    assert "of two kinds or more, are needed, and these are of 1" in result.stderr
