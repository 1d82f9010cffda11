"""Cameras from above and from the side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from covista_service.drawing.plots import COLOURS
from covista_service.drawing.scenario import Stage, Standing, from_above, perspective

from tests.service.drawing.pixels import drawn, pixels_of

OUTLINE_M = np.array([(0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0)])


def standing(label: str, x: float, group: int) -> Standing:
    place = np.array([x, 3.0, 1.0])
    rim = place + np.array([(0.5, 0.3, 0.2), (0.5, -0.3, 0.2), (0.5, -0.3, -0.2), (0.5, 0.3, -0.2)])
    return Standing(label, place, rim, np.array([(x, 3.0), (x + 2, 4.0), (x + 2, 2.0)]), group)


@pytest.fixture
def stage() -> Stage:
    return Stage("two", OUTLINE_M, [standing("1", 1.0, 0), standing("2", 5.0, 1)])


def test_each_group_has_a_colour(stage: Stage) -> None:
    one = drawn(from_above([replace(stage, standing=stage.standing[:1])], "one", ["a"], 1))
    both = drawn(from_above([stage], "two", ["a", "b"], 1))
    assert pixels_of(both, COLOURS[0]) > 50 < pixels_of(both, COLOURS[1])
    assert pixels_of(one, COLOURS[1]) == 0


def test_panels_are_laid_out_in_rows(stage: Stage) -> None:
    one = drawn(from_above([stage], "one", ["a", "b"], 1))
    five = drawn(from_above([stage] * 5, "five", ["a", "b"], 2))
    assert five.shape[1] == pytest.approx(2 * one.shape[1], abs=4)
    assert five.shape[0] > 2 * one.shape[0]


@pytest.mark.parametrize(("shared", "wider"), [(0.01, False), (0.6, True)])
def test_a_line_joins_those_who_see_the_same(stage: Stage, shared: float, wider: bool) -> None:
    together = replace(stage, standing=[stage.standing[0], replace(stage.standing[1], group=0)])
    mutual = np.array([[1.0, shared], [shared, 1.0]])
    with_line = drawn(from_above([replace(together, mutual=mutual)], "line", ["a"], 1))
    without = drawn(from_above([together], "line", ["a"], 1))
    assert bool((with_line != without).any()) == wider


def test_from_the_side_height_shows(stage: Stage) -> None:
    mutual = np.eye(2)
    low = drawn(perspective(replace(stage, mutual=mutual), 2.0))
    raised = replace(stage.standing[0], place_m=np.array([1.0, 3.0, 1.9]))
    high = drawn(perspective(replace(stage, standing=[raised, stage.standing[1]], mutual=mutual), 2.0))
    assert low.shape == high.shape
    left, right = (low != high)[:, : low.shape[1] // 2], (low != high)[:, low.shape[1] * 2 // 3 :]
    assert left.any()
    assert not right.any()


def test_labels_of_neighbours_do_not_cover_each_other(stage: Stage) -> None:
    """Two at one place get their labels on different sides, so more of them is to be seen than of one label twice."""
    near = replace(stage, standing=[standing("MMM", 4.0, 0), standing("WWW", 4.1, 0)])
    alone = replace(stage, standing=[standing("MMM", 4.0, 0)])
    ink = [int((drawn(from_above([each], "t", ["a"], 1)).max(axis=2) < 60).sum()) for each in (near, alone)]
    empty = replace(stage, standing=[standing("", 4.0, 0)])
    bare = int((drawn(from_above([empty], "t", ["a"], 1)).max(axis=2) < 60).sum())
    assert ink[0] - bare > 1.7 * (ink[1] - bare)
