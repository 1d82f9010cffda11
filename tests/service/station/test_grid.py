"""The grid finds what a look at all boxes finds, whatever their sizes, and keeps nothing of what is gone."""

import math

import pytest
from covista_service.perception.extent import Box
from covista_service.station.grid import Grid
from hypothesis import given
from hypothesis import strategies as st

coordinates = st.floats(-100, 100) | st.integers(-8, 8).map(float) | st.floats(-1e12, 1e12)
widths = st.floats(0, 10) | st.sampled_from([0.0, 1e-9, 1.0, 64.0, 1e6, math.inf])


@st.composite
def boxes(draw) -> Box:
    sides = [(low := draw(coordinates), low + draw(widths)) for _ in range(3)]
    if draw(st.booleans()):
        sides[0] = (-sides[0][1], -sides[0][0])
    (a, d), (b, e), (c, f) = sides
    return (a, b, c), (d, e, f)


def touch(one: Box, other: Box) -> bool:
    return all(one[0][k] <= other[1][k] and other[0][k] <= one[1][k] for k in range(3))


steps = st.lists(st.tuples(st.integers(0, 12).map(str), st.none() | boxes()), max_size=40)


@given(steps, boxes())
def test_it_finds_what_a_look_at_all_boxes_finds(changes, asked: Box) -> None:
    grid, held = Grid(), {}
    for name, box in changes:
        if box is None:
            grid.remove(name)
            held.pop(name, None)
        else:
            grid.put(name, box)
            held[name] = box
    found = grid.meeting(asked)
    assert sorted(found) == sorted(name for name, box in held.items() if touch(box, asked))
    assert len(set(found)) == len(found)
    assert len(grid) == len(held)
    assert all(name in grid for name in held)


@given(steps)
def test_what_was_taken_out_leaves_nothing_behind(changes) -> None:
    grid = Grid()
    for name, box in changes:
        if box is not None:
            grid.put(name, box)
    for name, _ in changes:
        grid.remove(name)
    assert (len(grid), grid._cells, grid._smaller, grid._levels, grid._endless) == (0, {}, {}, {}, {})


@given(boxes())
def test_a_box_lies_in_few_cells_whatever_its_size(box: Box) -> None:
    grid = Grid()
    grid.put("one", box)
    # Eight, but for what is so far off that a coordinate cannot tell the width of a cell.
    assert len(grid._cells) <= 27
    assert len(grid._smaller) <= 27


@pytest.mark.parametrize("count", [50, 1000])
def test_who_asks_looks_at_its_neighbours_alone(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    looked = []
    monkeypatch.setattr(
        "covista_service.station.grid._touch", lambda one, other: looked.append(one) or touch(one, other)
    )
    grid = Grid()
    for k in range(count):
        grid.put(str(k), ((4.0 * k, 0, 0), (4.0 * k + 5, 5, 5)))
    assert grid.meeting(((80.5, 1, 1), (84.5, 2, 2))) == ["19", "20", "21"]
    assert len(looked) <= 9


@pytest.mark.parametrize("count", [200, 2000])
@pytest.mark.parametrize("length_m", [64.0, 100.0, 129.0])
def test_who_sees_far_looks_at_those_before_it_alone(
    count: int, length_m: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked = []
    monkeypatch.setattr(
        "covista_service.station.grid._touch", lambda one, other: looked.append(one) or touch(one, other)
    )
    grid = Grid()
    for k in range(count):
        # Near-sighted ones on several levels, in a row much longer than any view.
        grid.put(str(k), ((4.0 * k, 0, 0), (4.0 * k + 1.5 * 2 ** (k % 4), 5, 5)))
    far = ((80.5, 1, 1), (80.5 + length_m, 1 + length_m, 1 + length_m))
    grid.put("far", far)
    found = grid.meeting(far)
    assert length_m / 4 <= len(found) <= length_m / 4 + 6
    assert len(looked) <= 5 * len(found)
