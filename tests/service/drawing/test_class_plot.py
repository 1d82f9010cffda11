from __future__ import annotations

import sys

import pytest
from covista_schemas.errors import MissingExtraError
from covista_service.drawing.class_plot import class_plot
from covista_service.drawing.plots import COLOURS

from tests.service.drawing.test_plots import drawn, pixels_of

CLASSES = ["few", "some", "many"]


def test_every_method_has_a_line_of_its_own_colour() -> None:
    picture = drawn(class_plot(CLASSES, {"one": [0.9, 0.5, 0.1], "two": [0.1, 0.5, 0.9]}, "title", "index"))
    assert min(pixels_of(picture, colour) for colour in COLOURS[:2]) > 300
    assert pixels_of(picture, COLOURS[2]) == 0


def test_what_is_not_known_is_a_gap() -> None:
    whole = drawn(class_plot(CLASSES, {"one": [0.9, 0.5, 0.1]}, "title", "index"))
    broken = drawn(class_plot(CLASSES, {"one": [0.9, None, 0.1]}, "title", "index"))
    nothing = drawn(class_plot(CLASSES, {"one": [None, None, None]}, "title", "index"))
    assert pixels_of(whole, COLOURS[0]) > pixels_of(broken, COLOURS[0]) > pixels_of(nothing, COLOURS[0])


@pytest.mark.parametrize("count", [1, 11, 30])
@pytest.mark.parametrize("height", [0.0, 0.97, -0.1])
def test_lines_that_end_together_are_drawn(count: int, height: float) -> None:
    drawn(class_plot(["one"], {f"method {k}": [height] for k in range(count)}, "title", "index"))


def test_the_same_values_give_the_same_bytes() -> None:
    assert class_plot(["a"], {"one": [0.4]}, "t", "y") == class_plot(["a"], {"one": [0.4]}, "t", "y")


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"covista\[bench\]"):
        class_plot(["a"], {"one": [0.4]}, "t", "y")
