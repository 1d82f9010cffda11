from __future__ import annotations

import sys

import cv2
import numpy as np
import pytest
from covista_schemas.errors import MissingExtraError
from covista_service.drawing.plots import COLOURS
from covista_service.drawing.timeline import bands
from numpy.typing import NDArray

GREY = "#dedede"


def share_of(png: bytes, colour: str) -> float:
    """Share of the picture in this colour (#rrggbb), nearly."""
    picture = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return float((np.abs(picture[..., ::-1].astype(int) - list(bytes.fromhex(colour[1:]))).max(axis=2) < 8).mean())


def drawn(labels: NDArray[np.intp]) -> bytes:
    return bands({"panel": labels}, {0: "first"}, "title", "step")


def test_groups_have_colours_and_robots_alone_are_grey() -> None:
    labels = np.ones((40, 6), np.intp)
    assert share_of(drawn(labels), COLOURS[0]) > 0.3
    labels[:, 3:] = 7
    labels[:, 5] = 9
    half = drawn(labels)
    assert share_of(half, COLOURS[0]) == pytest.approx(share_of(half, COLOURS[1]) * 3 / 2, rel=0.15)
    assert share_of(half, GREY) == pytest.approx(share_of(half, COLOURS[1]) / 2, rel=0.15)


def test_a_robot_that_changes_takes_the_colour_of_its_new_group() -> None:
    labels = np.repeat([[1, 1, 1, 2, 2]], 40, axis=0).astype(np.intp)
    before = share_of(drawn(labels), COLOURS[1])
    labels[20:, 2] = 2
    assert before * 1.15 < share_of(drawn(labels), COLOURS[1]) < before * 1.3


def test_more_groups_than_colours_and_a_single_step_are_drawn() -> None:
    drawn(np.repeat(np.arange(1, 13), 2)[None].astype(np.intp))


def test_panels_lie_one_below_the_other() -> None:
    labels = np.ones((30, 8), np.intp)
    one = bands({"a": labels}, {}, "title", "step")
    two = bands({"a": labels, "b": labels}, {}, "title", "step")
    heights = [cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR).shape[0] for png in (one, two)]
    assert heights[1] > 1.5 * heights[0]


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"covista\[bench\]"):
        drawn(np.ones((2, 2), np.intp))
