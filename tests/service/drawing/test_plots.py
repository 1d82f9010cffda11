from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from covista_schemas.errors import MissingExtraError
from covista_service.drawing import plots

from tests.service.drawing.pixels import drawn, pixels_of


def panel(count: int) -> plots.Panel:
    share = np.linspace(0, 1, count)
    return plots.Panel("planes", share, share)


def test_every_method_has_a_panel() -> None:
    one = drawn(plots.scatters([panel(9)], "set", "true", "answered"))
    nine = drawn(plots.scatters([panel(9)] * 9, "set", "true", "answered"))
    assert nine.shape[1] > 3 * one.shape[1]
    assert nine.shape[0] > 2 * one.shape[0]


def test_bars_of_two_methods_differ_in_colour_and_none_has_no_bar() -> None:
    both = drawn(plots.bars(["a", "b"], {"one": [0.5, 0.4], "two": [0.3, 0.2]}, "title", "error"))
    lacking = drawn(plots.bars(["a", "b"], {"one": [0.5, None], "two": [0.3, 0.2]}, "title", "error"))
    assert min(pixels_of(both, colour) for colour in plots.COLOURS[:2]) > 1000
    assert pixels_of(lacking, plots.COLOURS[0]) < pixels_of(both, plots.COLOURS[0])


def test_many_sets_with_long_names_are_drawn() -> None:
    names = [f"a_set_with_a_long_name_{k}" for k in range(8)]
    drawn(plots.bars(names, {"auto": [0.1] * 8}, "title", "error"))


def test_boxes_hold_few_values_and_none() -> None:
    drawn(plots.boxes({"one": np.array([0.1]), "none": np.zeros(0)}, "title", "error"))


def test_curves_and_tables_are_drawn() -> None:
    x = np.logspace(-1, 1, 5)
    curves = drawn(plots.curves({"a": [plots.Curve("flat", x, np.full(5, 0.5))]}, "title", "w", "q"))
    assert pixels_of(curves, plots.COLOURS[0]) > 200
    short = drawn(plots.table("title", ["a", "b"], [["1", "2"]]))
    long = drawn(plots.table("title", ["a", "b"], [["1", "2"]] * 9))
    assert long.shape[0] > short.shape[0]


def test_the_same_values_give_the_same_bytes() -> None:
    assert plots.scatters([panel(5)], "set", "true", "answered") == plots.scatters(
        [panel(5)], "set", "true", "answered"
    )


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"covista\[bench\]"):
        plots.table("title", ["a"], [["1"]])


def test_matplotlib_is_imported_when_something_is_drawn() -> None:
    code = "import sys, covista_service.drawing.plots; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
