"""Overlaps that change because robots move are known, not measured: they are not smoothed."""

import numpy as np
import pytest
from covista_service.grouping.affinity import Affinity
from hypothesis import given
from hypothesis import strategies as st

smoothings = st.floats(0.05, 0.95)
middling = st.lists(st.floats(0.4, 0.6), min_size=1, max_size=6)
shares = st.floats(0, 1)


def two(smoothing: float) -> Affinity:
    affinity = Affinity(smoothing)
    affinity.add("a", (0, 0, 0))
    affinity.add("b", (1, 0, 0))
    return affinity


def see(affinity: Affinity, q: float, **how: bool) -> float:
    affinity.see("a", "b", q, q, **how)
    return float(affinity.mutual[0, 1])


@given(smoothings, middling, middling, st.floats(-0.3, 0.3))
def test_a_motion_shifts_what_was_measured_before_and_what_is_measured_next(
    smoothing: float, before: list[float], after: list[float], shift: float
) -> None:
    moved, still = two(smoothing), two(smoothing)
    for q in before:
        see(moved, q)
        see(still, q)
    see(moved, before[-1] + shift, moved=True)
    assert moved.mutual[0, 1] == pytest.approx(still.mutual[0, 1] + shift, abs=1e-12)
    for q in after:
        see(moved, q + shift)
        see(still, q)
    assert moved.mutual[0, 1] == pytest.approx(still.mutual[0, 1] + shift, abs=1e-12)


@given(smoothings, middling, st.lists(st.floats(0.3, 0.7), min_size=1, max_size=8))
def test_many_motions_are_one(smoothing: float, measured: list[float], way: list[float]) -> None:
    """Incremental = batch: on the way nothing is lost as long as nothing is clipped."""
    steps, leap = two(smoothing), two(smoothing)
    for q in measured:
        see(steps, q)
        see(leap, q)
    for q in way:
        see(steps, q, moved=True)
    see(leap, way[-1], moved=True)
    assert steps.mutual[0, 1] == pytest.approx(leap.mutual[0, 1], abs=1e-12)


@given(smoothings, shares, st.lists(shares, min_size=1, max_size=8))
def test_after_one_measurement_a_motion_leads_to_what_is_read(smoothing: float, first: float, way: list[float]) -> None:
    affinity = two(smoothing)
    see(affinity, first)
    for q in way:
        assert see(affinity, q, moved=True) == q


@given(smoothings, st.lists(st.tuples(shares, st.sampled_from(["new", "again", "moved"])), min_size=1, max_size=12))
def test_whatever_comes_a_share_is_a_share(smoothing: float, told: list[tuple[float, str]]) -> None:
    affinity = two(smoothing)
    for q, how in told:
        mutual = see(affinity, q, again=how == "again", moved=how == "moved")
        assert 0 <= mutual <= 1
        assert affinity.overlap[0, 1] == affinity.overlap[1, 0] == q


@given(smoothings, shares, shares)
def test_where_nothing_was_known_what_is_read_stands(smoothing: float, q: float, next_q: float) -> None:
    affinity = two(smoothing)
    assert see(affinity, q, moved=True) == q
    affinity.see("a", "b", None, None)
    assert np.isnan(affinity.mutual[0, 1])
    assert see(affinity, next_q, moved=True) == next_q


def test_both_shares_count() -> None:
    affinity = two(0.25)
    affinity.see("a", "b", 0.5, 0.3)
    affinity.see("a", "b", 0.9, 0.7)
    before = affinity.mutual[0, 1]
    affinity.see("b", "a", 0.2, 0.8, moved=True)
    assert affinity.mutual[0, 1] == pytest.approx(before + 0.5 - 0.8)


def test_without_smoothing_a_motion_is_as_any_news() -> None:
    affinity = two(1.0)
    for q in (0.1, 0.9, 0.4):
        assert see(affinity, q, moved=True) == q
