import numpy as np
import pytest
from covista_service.perception.agreement import (
    AGREED,
    CARRIED,
    CONTRADICTED,
    SINGLE,
    AgreementOptions,
    DepthPoints,
    Observations,
    agree,
)

OPTIONS = AgreementOptions()


def said(keypoints: list[int], inverse_depths: list[float], sigma: float = 0.001, free: bool = True) -> Observations:
    count = len(keypoints)
    return Observations(
        np.array(keypoints, np.int64), np.array(inverse_depths), np.full(count, sigma), np.full(count, free)
    )


PIXELS = np.column_stack((np.arange(40.0) * 10, np.full(40, 100.0)))


def test_nothing_said_is_no_points() -> None:
    assert len(agree([], PIXELS, 640, OPTIONS)) == 0
    assert len(agree([said([], [])], PIXELS, 640, OPTIONS)) == 0


def test_two_pairs_that_agree_beat_one_that_does_not() -> None:
    points = agree([said([3], [0.50]), said([3], [0.505]), said([3], [0.9])], PIXELS, 640, OPTIONS)
    assert points.inverse_depths == pytest.approx([0.5025])
    assert points.confidences.tolist() == [AGREED]
    assert points.sigmas == pytest.approx([0.001 / np.sqrt(2)])
    assert points.positions_px.tolist() == [PIXELS[3].tolist()]


def test_confidence_tells_single_from_contradicted() -> None:
    points = agree([said([1, 2], [0.5, 0.5]), said([2], [0.9])], PIXELS, 640, OPTIONS)
    assert points.confidences.tolist() == [SINGLE, CONTRADICTED]


def test_the_order_of_pairs_does_not_matter() -> None:
    pairs = [said([1, 2, 5], [0.5, 0.4, 0.3]), said([2, 5], [0.41, 0.9], 0.002), said([5, 1], [0.31, 0.5], 0.004)]
    forth, back = agree(pairs, PIXELS, 640, OPTIONS), agree(pairs[::-1], PIXELS, 640, OPTIONS)
    assert forth.inverse_depths == pytest.approx(back.inverse_depths, rel=1e-12)
    assert forth.confidences.tolist() == back.confidences.tolist()


def test_a_single_that_nothing_supports_is_dropped() -> None:
    agreed = list(range(30))
    flat = [0.5] * 30
    lone, fitting = 35, 36
    pairs = [said(agreed, flat), said(agreed, flat), said([lone, fitting], [2.0, 0.5])]
    points = agree(pairs, PIXELS, 640, OPTIONS)
    kept = {tuple(position) for position in points.positions_px.tolist()}
    assert tuple(PIXELS[fitting].tolist()) in kept
    assert tuple(PIXELS[lone].tolist()) not in kept


def test_where_all_are_singles_none_is_dropped() -> None:
    points = agree([said(list(range(40)), [0.5] * 39 + [3.0])], PIXELS, 640, OPTIONS)
    assert len(points) == 40


def test_a_keypoint_with_two_orientations_does_not_bear_itself_out() -> None:
    agreed = list(range(30))
    lone, twin = 35, 36
    places = PIXELS.copy()
    places[twin] = places[lone]
    pairs = [said(agreed, [0.5] * 30), said(agreed, [0.5] * 30), said([lone, twin], [2.0, 2.0])]
    points = agree(pairs, places, 640, OPTIONS)
    assert tuple(places[lone].tolist()) not in {tuple(position) for position in points.positions_px.tolist()}


def test_what_is_known_from_elsewhere_speaks_against_singles() -> None:
    """Singles that are all there is stay, unless most of what is known around them says otherwise."""
    few = said([0, 1, 2], [2.0, 2.0, 0.5])
    known = DepthPoints(PIXELS[3:], np.full(37, 0.5), np.full(37, 1e-3), np.full(37, CARRIED))
    assert len(agree([few], PIXELS, 640, OPTIONS)) == 3
    points = agree([few], PIXELS, 640, OPTIONS, known)
    assert points.inverse_depths.tolist() == [0.5]
