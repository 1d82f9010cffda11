from __future__ import annotations

import numpy as np
import pytest
from covista_service.evaluation.planted.judging import adjusted_rand
from covista_service.evaluation.planted.methods import METHODS
from covista_service.evaluation.planted.rendered import RenderedSwarm, rendered
from covista_service.evaluation.planted.run import methods_of


@pytest.fixture(scope="module")
def seen() -> RenderedSwarm:
    return rendered(1)


def test_pictures_tell_who_looks_at_the_same(seen: RenderedSwarm) -> None:
    swarm = seen.swarm
    count = len(swarm)
    assert 8 <= count <= 14
    mates = (swarm.truth[:, None] == swarm.truth) & ~np.eye(count, dtype=bool)
    shared = np.where(np.isnan(swarm.overlap), 0, swarm.overlap)
    assert shared[mates].mean() > shared[swarm.truth[:, None] != swarm.truth].mean() + 0.3
    assert seen.features[mates].mean() > seen.features[swarm.truth[:, None] != swarm.truth].mean()
    assert np.array_equal(seen.features, seen.features.T)
    assert np.array_equal(seen.swarm.sharing, seen.swarm.sharing.T)


def test_numbers_of_features_group_too(seen: RenderedSwarm) -> None:
    methods = methods_of(seen)
    assert set(methods) == {*METHODS, "features"}
    assert adjusted_rand(seen.swarm.truth, methods["features"](seen.swarm)) > 0.5
