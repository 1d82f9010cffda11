from __future__ import annotations

import numpy as np
import pytest
from covista_service.evaluation.planted.layout import KINDS, Kind, all_apart, all_in_one, group_sizes
from covista_service.evaluation.planted.layout import planted as laid_out
from covista_service.evaluation.planted.swarm import BLOCK, CLASSES, STORIES, Disturbance, disturbed, plant
from covista_service.evaluation.planted.views import overlap
from scipy.sparse.csgraph import connected_components

NOTHING = Disturbance(noise=0.0, unknown=0.0)


@pytest.mark.parametrize("count", [6, 7, 30, 200])
def test_sizes_add_up(count: int) -> None:
    for seed in range(50):
        sizes = group_sizes(np.random.default_rng(seed), count)
        assert sum(sizes) == count
        assert all(1 <= size <= 8 for size in sizes)


def test_a_block_has_every_kind_in_every_class_of_size() -> None:
    found = [(known.kind, len(known.truth)) for known in map(plant, range(BLOCK))]
    assert {kind for kind, _ in found} == set(STORIES)
    for kind in KINDS:
        for least, most in CLASSES:
            assert sum(each == kind and least <= count <= most for each, count in found) == 1


def test_larger_swarms_come_when_they_are_asked_for() -> None:
    assert len(plant(12, largest=90).truth) <= 90
    assert max(len(plant(seed, largest=500).truth) for seed in range(12, BLOCK * 4, BLOCK)) > 200


@pytest.mark.parametrize("seed", [1, 3, 6, 17])
def test_the_same_seed_gives_the_same_swarm(seed: int) -> None:
    one, other = (disturbed(plant(seed), Disturbance(bias=0.2)) for _ in range(2))
    assert np.array_equal(one.overlap, other.overlap, equal_nan=True)
    assert np.array_equal(one.truth, other.truth)
    assert not np.array_equal(one.overlap, disturbed(plant(seed + BLOCK), Disturbance()).overlap, equal_nan=True)


@pytest.mark.parametrize("kind", KINDS)
def test_members_see_what_their_mates_see(kind: Kind) -> None:
    layout = laid_out(np.random.default_rng(5), kind, 40)
    shared = overlap(layout.scene, layout.views)
    mates = layout.truth[:, None] == layout.truth
    np.fill_diagonal(mates, val=False)
    assert shared[mates].mean() > 0.5
    assert shared[layout.truth[:, None] != layout.truth].mean() < 0.15


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [6, 25])
def test_all_in_one_see_one_thing(kind: Kind, count: int) -> None:
    layout = all_in_one(np.random.default_rng(6), kind, count)
    shared = overlap(layout.scene, layout.views)
    assert set(layout.truth.tolist()) == {0}
    parts, _ = connected_components((shared + shared.T) / 2 > 0.4)
    assert parts == 1


@pytest.mark.parametrize("kind", KINDS)
def test_all_apart_are_far_from_one_another_and_share_nothing(kind: Kind) -> None:
    layout = all_apart(np.random.default_rng(7), kind, 20)
    assert overlap(layout.scene, layout.views) == pytest.approx(np.eye(20), abs=1e-9)
    centres = layout.views.centres_m
    apart = np.linalg.norm(centres[:, None] - centres, axis=2)[~np.eye(20, dtype=bool)]
    assert apart.min() > 30
    assert len(set(layout.truth.tolist())) == 20


def test_without_a_disturbance_overlaps_are_true() -> None:
    known = plant(4)
    assert np.array_equal(disturbed(known, NOTHING).overlap, known.overlap)


def test_noise_is_as_large_as_said_where_nothing_is_cut_off() -> None:
    known = plant(13)
    found = disturbed(known, Disturbance(noise=0.05, unknown=0.0))
    inner = (known.overlap > 0.3) & (known.overlap < 0.7)
    assert (found.overlap - known.overlap)[inner].std() == pytest.approx(0.05, rel=0.15)
    assert found.overlap.min() >= 0
    assert found.overlap.max() <= 1


def test_unknown_pairs_are_unknown_both_ways_and_nobody_is_unknown_to_himself() -> None:
    shares = []
    for seed in range(0, BLOCK * 2, 3):
        missing = np.isnan(disturbed(plant(seed), Disturbance()).overlap)
        assert np.array_equal(missing, missing.T)
        assert not missing.diagonal().any()
        shares.append(missing.mean())
    assert 0 <= min(shares) < 0.1 < max(shares) <= 0.4


def test_predicted_pairs_are_known_and_less_sure() -> None:
    known = plant(13)
    hidden = np.isnan(disturbed(known, Disturbance()).overlap)
    measured, predicted = (disturbed(known, Disturbance(predicted=either)).overlap for either in (False, True))
    assert np.isfinite(predicted).all()
    assert np.array_equal(measured[~hidden], predicted[~hidden])
    seen = known.overlap > 0.2
    error = np.abs(predicted - known.overlap)
    assert error[hidden & seen].mean() > error[~hidden & seen].mean()


def test_a_bias_moves_all_overlaps_of_a_robot_the_same_way() -> None:
    known = plant(14)
    biased = disturbed(known, Disturbance(noise=0.0, unknown=0.0, bias=0.2)).overlap
    seen = (known.overlap > 0.05) & (biased < 1)
    assert np.array_equal(biased > 0, known.overlap > 0)
    ratio = np.divide(biased, known.overlap, out=np.ones_like(biased), where=seen)
    both = seen & seen.T
    assert ratio[both] == pytest.approx(ratio.T[both])
    assert np.log(ratio[both]).std() > 0.15
