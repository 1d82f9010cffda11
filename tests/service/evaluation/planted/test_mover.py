"""The mover: what is planted, what is measured, and that hysteresis keeps groups still without freezing anybody."""

import numpy as np
import pytest
from covista_service.evaluation.planted import mover
from covista_service.evaluation.planted.mover import Drive, Setting
from covista_service.grouping.hysteresis import HysteresisOptions
from covista_service.grouping.selection import SelectionOptions
from covista_service.grouping.similarity import Floats

GAIN = SelectionOptions(criterion="gain")
AS_PROPOSED, HYSTERESIS = mover.SETTINGS[0], mover.SETTINGS[-1]


def driven(count: int = 10, seed: int = 0, steps: int = 41) -> Drive:
    return mover.drive(count, np.random.default_rng(seed), steps)


@pytest.mark.parametrize("count", [10, 30, 100])
def test_the_mover_drives_from_the_first_group_to_the_second(count: int) -> None:
    drive = driven(count)
    first, second = (np.flatnonzero(drive.planted == group) for group in (0, 1))
    assert first[0] == 0
    assert min(np.bincount(drive.planted)[:-1]) >= 3
    mates = first[1:]
    assert drive.distance_m[0, 0, mates].mean() < drive.distance_m[0, 0, second].mean()
    assert drive.distance_m[-1, 0, second].mean() < drive.distance_m[-1, 0, mates].mean()
    everyone_else = drive.distance_m[:, 1:, 1:]
    np.testing.assert_array_equal(everyone_else, np.broadcast_to(everyone_else[0], everyone_else.shape))


def test_overlaps_are_shares_that_are_measured_with_noise_and_the_last_pair_jumps() -> None:
    drive = driven(30, steps=101)
    for overlap in (drive.true, drive.measured):
        assert overlap.min() >= 0
        assert overlap.max() <= 1
        np.testing.assert_array_equal(overlap, overlap.transpose(0, 2, 1))
        assert (np.diagonal(overlap, axis1=1, axis2=2) == 1).all()
    error = (drive.measured - drive.true)[:, 1:-2, 1:-2]
    # Where nothing is cut off at 0 or 1.
    plain = (drive.true[:, 1:-2, 1:-2] > 0.2) & (drive.true[:, 1:-2, 1:-2] < 0.8)
    assert np.std(error[plain]) == pytest.approx(mover.NOISE, rel=0.1)
    pair = drive.measured[:, -1, -2]
    assert (pair > 0.35).mean() == pytest.approx(0.5, abs=0.15)
    assert not ((pair > 0.28) & (pair < 0.42)).any()


def test_the_same_seed_is_the_same_drive() -> None:
    np.testing.assert_array_equal(driven(seed=3).measured, driven(seed=3).measured)
    assert (driven(seed=3).measured != driven(seed=4).measured).any()


@pytest.mark.parametrize("newest", [0.3, 1.0])
def test_smoothing_keeps_what_stays_and_follows_what_jumps(newest: float) -> None:
    jumps: Floats = np.zeros((6, 1, 1))
    jumps[2:] = 1.0
    expected = [0, 0, *(1 - (1 - newest) ** np.arange(1, 5))]
    np.testing.assert_allclose(mover.smoothed(jumps, newest)[:, 0, 0], expected)


def test_without_hysteresis_labels_are_the_proposals_and_keep_to_their_groups() -> None:
    drive = driven()
    labels = mover.labels_over_time(drive.distance_m, drive.true, GAIN, None)
    assert labels.shape == (41, 10)
    # The mover's mates keep their label, which the mover loses; those whom it joins had theirs before.
    mates, goal = drive.planted[1:-2] == 0, drive.planted[1:-2] == 1
    assert len(set(labels[:, 1:-2][:, mates].ravel())) == 1
    assert labels[0, 0] == labels[0, 1]
    assert labels[-1, 0] == labels[0, 1:-2][goal][0] != labels[0, 0]


def test_hysteresis_changes_less_than_what_is_proposed_and_freezes_nobody() -> None:
    raw, held = mover.rows(GAIN, (10,), 3, (AS_PROPOSED, HYSTERESIS))
    assert (raw.setting, held.setting) == (AS_PROPOSED.name, HYSTERESIS.name)
    assert raw.true_per_100 == held.true_per_100
    assert held.changes_per_100 < raw.changes_per_100 / 4
    assert held.changes_per_100 <= held.true_per_100 + 2
    assert raw.lag_steps <= held.lag_steps < 10
    assert held.astray < 0.2


def test_by_default_others_than_the_mover_hardly_change() -> None:
    raw, held = mover.rows(SelectionOptions(), (10,), 4, (AS_PROPOSED, HYSTERESIS), seed=1)
    assert held.others_per_100 < raw.others_per_100 / 8
    # No more than the true overlaps make.
    assert held.changes_per_100 <= raw.true_per_100
    assert held.astray < 0.25


def test_a_change_that_never_comes_lags_until_the_mover_leaves_again() -> None:
    frozen = Setting("frozen", HysteresisOptions(persistence_s=np.inf, clear=np.inf), smoothed=False)
    (row,) = mover.rows(GAIN, (10,), 2, (frozen,))
    assert row.changes_per_100 == 0
    assert row.lag_steps > 20
    assert row.astray > 0.3


def test_time_lines_are_drawn_from_the_same_drive() -> None:
    lines = mover.timelines(GAIN, 10)
    assert list(lines) == [AS_PROPOSED.name, HYSTERESIS.name]
    assert all(labels.shape == (mover.STEPS, 10) for labels in lines.values())
    assert mover.plot(lines).startswith(b"\x89PNG")
