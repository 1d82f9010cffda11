"""Whatever happens, the matrices kept row by row are those computed from scratch."""

import math

import numpy as np
import pytest
from covista_service.grouping.affinity import Affinity
from covista_service.grouping.similarity import sigma_m
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from scipy.spatial.distance import pdist, squareform

NAMES = [f"r{number}" for number in range(24)]
coordinates = st.floats(-1e3, 1e3, allow_nan=False) | st.integers(-3, 3).map(float)
positions = st.tuples(coordinates, coordinates, coordinates)
shares = st.floats(0, 1) | st.none()


def batch(position_m: dict[str, tuple[float, ...]], overlaps: dict[tuple[str, str], float | None], alpha: float):
    """Eqs. 15 and 16, robot by robot."""
    robots = sorted(position_m)
    distances = pdist(np.array([position_m[robot] for robot in robots]).reshape(-1, 3))
    distance_m = squareform(distances) if len(robots) > 1 else np.zeros((len(robots), len(robots)))
    sigma = 1.0
    if len(distances) and distances.mean() > 0:
        sigma = distances.std() if distances.std() > 1e-9 * distances.mean() else distances.mean()
    S = np.eye(len(robots))
    for i, a in enumerate(robots):
        for j, b in enumerate(robots):
            if i != j:
                near = math.exp(-((distance_m[i, j] / sigma) ** 2))
                q_a, q_b = overlaps.get((a, b)), overlaps.get((b, a))
                known = q_a is not None and q_b is not None
                S[i, j] = alpha * (q_a + q_b) / 2 + (1 - alpha) * near if known else near
    return S, distance_m


class Swarm(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        self.affinity = Affinity()
        self.position_m: dict[str, tuple[float, ...]] = {}
        self.overlaps: dict[tuple[str, str], float | None] = {}

    @rule(name=st.sampled_from(NAMES), position_m=positions)
    def join_or_move(self, name: str, position_m: tuple[float, ...]) -> None:
        if name in self.affinity:
            self.affinity.move(name, position_m)
        else:
            self.affinity.add(name, position_m)
        self.position_m[name] = position_m

    @precondition(lambda self: len(self.position_m) > 1)
    @rule(data=st.data(), q_a=shares, q_b=shares)
    def see(self, data: st.DataObject, q_a: float | None, q_b: float | None) -> None:
        a, b = data.draw(st.lists(st.sampled_from(sorted(self.position_m)), min_size=2, max_size=2, unique=True))
        self.affinity.see(a, b, q_a, q_b)
        self.overlaps[a, b], self.overlaps[b, a] = q_a, q_b

    @precondition(lambda self: self.position_m)
    @rule(data=st.data())
    def leave(self, data: st.DataObject) -> None:
        name = data.draw(st.sampled_from(sorted(self.position_m)))
        self.affinity.remove(name)
        del self.position_m[name]
        self.overlaps = {pair: q for pair, q in self.overlaps.items() if name not in pair}

    @invariant()
    def equals_the_batch(self) -> None:
        S, distance_m = batch(self.position_m, self.overlaps, 0.4)
        assert self.affinity.robots == tuple(sorted(self.position_m))
        np.testing.assert_allclose(self.affinity.distance_m, distance_m, rtol=0, atol=1e-12 * 1e3)
        np.testing.assert_allclose(self.affinity.similarity(0.4), S, rtol=0, atol=1e-12)


TestSwarm = Swarm.TestCase
TestSwarm.settings = settings(max_examples=60, stateful_step_count=50, deadline=None)


def row(*along_m: float) -> Affinity:
    affinity = Affinity()
    for number, x in enumerate(along_m):
        affinity.add(f"r{number}", (x, 0, 0))
    return affinity


def test_overlap_has_ones_on_the_diagonal_and_says_where_it_is_unknown() -> None:
    affinity = row(0, 1, 2)
    affinity.see("r2", "r0", 0.25, 0.75)
    expected = [[1, np.nan, 0.75], [np.nan, 1, np.nan], [0.25, np.nan, 1]]
    np.testing.assert_array_equal(affinity.overlap, expected)


def test_unknown_overlap_leaves_the_word_to_distance() -> None:
    affinity = row(0, 1, 3)
    np.testing.assert_array_equal(affinity.similarity(0.9), affinity.closeness())
    affinity.see("r0", "r1", 0.0, 0.0)
    assert affinity.similarity(0.9)[0, 1] == pytest.approx(0.1 * affinity.closeness()[0, 1])


def test_all_robots_in_one_place_are_as_close_as_can_be() -> None:
    np.testing.assert_array_equal(row(2, 2, 2).closeness(), np.ones((3, 3)))


def test_equal_distances_are_measured_by_their_mean() -> None:
    assert row(0, 8).closeness()[0, 1] == pytest.approx(math.exp(-1))


def test_a_swarm_that_was_far_apart_can_be_tight_again() -> None:
    affinity = row(0, 1e8, 3e8)
    for number, x in enumerate((0.0, 1e-4, 3e-4)):
        affinity.move(f"r{number}", (x, 0, 0))
    np.testing.assert_allclose(affinity.closeness(), row(0, 1, 3).closeness(), atol=1e-9)


def test_sigma_in_metres_is_taken_as_given() -> None:
    assert row(0, 2).closeness(4.0)[0, 1] == pytest.approx(math.exp(-0.25))


@pytest.mark.parametrize("count", [0, 1])
def test_nobody_and_one_alone_have_matrices_too(count: int) -> None:
    affinity = row(*range(count))
    assert affinity.similarity(0.5).shape == (count, count)
    assert sigma_m(affinity.distance_m, "std") == 1.0


def test_nobody_joins_twice() -> None:
    with pytest.raises(ValueError, match="r0 is there already"):
        row(0).add("r0", (1, 1, 1))
