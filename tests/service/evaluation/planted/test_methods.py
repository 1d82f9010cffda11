from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from covista_service.evaluation.planted.comparators import coslams, mutual
from covista_service.evaluation.planted.judging import adjusted_rand
from covista_service.evaluation.planted.methods import METHODS, similarity_of
from covista_service.evaluation.planted.swarm import Disturbance, disturbed, plant

from tests.service.evaluation.planted.swarms import clear


@pytest.mark.parametrize("name", METHODS)
def test_groups_that_are_clear_are_found(name: str) -> None:
    swarm = clear((4, 3, 4))
    assert adjusted_rand(swarm.truth, METHODS[name](swarm)) == 1.0


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("seed", [0, 7, 16, 17])
def test_every_robot_has_a_label_and_the_same_again(name: str, seed: int) -> None:
    swarm = disturbed(plant(seed), Disturbance())
    one, other = METHODS[name](swarm), METHODS[name](swarm)
    assert one.shape == (len(swarm),)
    assert np.array_equal(one, other)


@pytest.mark.parametrize("name", METHODS)
def test_the_order_of_robots_does_not_matter(name: str) -> None:
    swarm = clear((4, 3, 4))
    order = np.random.default_rng(0).permutation(len(swarm))
    turned = replace(
        swarm,
        positions_m=swarm.positions_m[order],
        overlap=swarm.overlap[np.ix_(order, order)],
        sharing=swarm.sharing[np.ix_(order, order)],
        truth=swarm.truth[order],
    )
    assert adjusted_rand(METHODS[name](swarm)[order], METHODS[name](turned)) == 1.0


def test_similarities_have_no_gap_whatever_is_unknown() -> None:
    swarm = clear((4, 3, 4))
    blind = replace(swarm, overlap=np.where(np.eye(len(swarm)) > 0, 1.0, np.nan))
    for each in (swarm, blind, disturbed(plant(3), Disturbance(unknown=1.0))):
        S = similarity_of(each, "std", 0.5)
        assert np.isfinite(S).all()
        assert np.array_equal(S, S.T)
        assert (S.diagonal() == 1).all()


def test_components_do_not_ask_who_is_unknown() -> None:
    swarm = clear((4, 4))
    blind = replace(swarm, overlap=np.where(np.eye(len(swarm)) > 0, 1.0, np.nan))
    assert np.array_equal(mutual(blind), np.eye(len(swarm)))
    assert len(set(METHODS["overlap"](blind).tolist())) == len(swarm)


def test_one_link_is_enough_for_components_and_too_little_for_groups() -> None:
    swarm = clear((5, 5))
    a, b = int(np.flatnonzero(swarm.truth == 0)[0]), int(np.flatnonzero(swarm.truth == 1)[0])
    overlap = swarm.overlap.copy()
    overlap[a, b] = overlap[b, a] = 0.7
    linked = replace(swarm, overlap=overlap)
    assert len(set(METHODS["overlap"](linked).tolist())) == 1
    assert adjusted_rand(swarm.truth, METHODS["fiedler"](linked)) == 1.0


def test_the_station_s_components_hang_together_over_strong_links() -> None:
    swarm = clear((5, 5))
    assert adjusted_rand(swarm.truth, METHODS["components"](swarm)) == 1.0
    a, b = int(np.flatnonzero(swarm.truth == 0)[0]), int(np.flatnonzero(swarm.truth == 1)[0])
    overlap = swarm.overlap.copy()
    overlap[a, b] = overlap[b, a] = 0.7
    positions_m = swarm.positions_m.copy()
    positions_m[b] = positions_m[a]
    near = replace(swarm, overlap=overlap, positions_m=positions_m)
    # The one has gone over to the other group, and takes nobody along: its own are too far away now.
    assert adjusted_rand(np.where(np.arange(10) == b, 0, swarm.truth), METHODS["components"](near)) == 1.0


def test_coslam_parts_who_shares_nothing_and_who_is_too_far_away() -> None:
    swarm = clear((4, 4))
    assert adjusted_rand(swarm.truth, coslams(swarm)) == 1.0
    everyone = replace(swarm, sharing=np.ones((8, 8), np.bool_))
    assert len(set(coslams(everyone).tolist())) == 1
    # One of many stands more than six times as far away as two usually do.
    many = clear((30,))
    far = replace(many, positions_m=np.vstack([many.positions_m[:-1], [(500.0, 0, 0)]]))
    assert sorted(np.bincount(coslams(far)).tolist()) == [1, 29]
