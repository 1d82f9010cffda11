"""Eqs. 15 and 16: the range of closeness, what is unknown, and what must not matter."""

import math

import numpy as np
import pytest
from covista_service.grouping.similarity import (
    Sigma,
    closeness,
    matrix,
    mutual_overlap,
    shared_sigma_m,
    sigma_m,
    similarity,
    spread_m,
    standard_sigma_m,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from tests.service.grouping.swarms import Floats, distances, reordered

SIGMAS: tuple[Sigma, ...] = ("shared", "std", 3.0)
by_sigma = pytest.mark.parametrize("sigma", SIGMAS)
by_itself = pytest.mark.parametrize("sigma", ["shared", "std"])


def at(*position_m: tuple[float, ...]) -> Floats:
    return distances(np.array(position_m, np.float64).reshape(-1, 3))


def unknown(count: int) -> Floats:
    overlap = np.full((count, count), np.nan)
    np.fill_diagonal(overlap, 1.0)
    return overlap


def sharing(count: int, **shares: float) -> Floats:
    """Mutual overlaps (count, count), known between some: _01=.5."""
    mutual = unknown(count)
    for pair, q in shares.items():
        i, j = map(int, pair.removeprefix("_"))
        mutual[i, j] = mutual[j, i] = q
    return mutual


def swarm(seed: int, count: int, known: float = 0.7) -> tuple[Floats, Floats]:
    """Positions (N, 3) in general, and overlaps (N, N), a share of them known."""
    rng = np.random.default_rng(seed)
    overlap = np.where(rng.uniform(size=(count, count)) < known, rng.uniform(size=(count, count)), np.nan)
    np.fill_diagonal(overlap, 1.0)
    return rng.uniform(-8, 8, (count, 3)), overlap


seeds, counts = st.integers(0, 10_000), st.integers(0, 12)

TRIANGLE = at((0, 0, 0), (2, 0, 0), (1, math.sqrt(3), 0))


@by_itself
@pytest.mark.parametrize(
    ("distance_m", "expected"),
    [
        (at(), 1.0),
        (at((1, 2, 3)), 1.0),
        (at((1, 2, 3), (1, 2, 3), (1, 2, 3)), 1.0),
        (at((0, 0, 0), (0, 0, 7)), 7.0),
        (TRIANGLE, 2.0),
    ],
    ids=["nobody", "one", "all in one place", "two", "an equilateral triangle"],
)
def test_the_range_where_distances_have_no_spread(sigma: Sigma, distance_m: Floats, expected: float) -> None:
    # What nobody has compared tells nothing of how far is too far.
    expected *= 6 if sigma == "shared" and expected > 1 else 1
    assert sigma_m(distance_m, unknown(len(distance_m)), sigma) == pytest.approx(expected)


def test_as_printed_the_range_is_the_standard_deviation_of_the_distances() -> None:
    # 1, 2 and 3: mean 2.
    assert standard_sigma_m(at((0, 0, 0), (1, 0, 0), (3, 0, 0))) == pytest.approx(math.sqrt(2 / 3))


@given(apart_m=st.lists(st.floats(0, 1e3), min_size=1, max_size=40))
def test_the_spread_follows_from_sums(apart_m: list[float]) -> None:
    squares_m2 = np.square(apart_m)
    spread = spread_m(len(apart_m), math.fsum(apart_m), math.fsum(squares_m2))
    assert spread > 0
    mean = np.mean(apart_m)
    if np.std(apart_m) > 1e-3 * mean:
        assert spread == pytest.approx(np.std(apart_m), rel=1e-8)
    elif np.std(apart_m) < 1e-9 * mean:
        assert spread == pytest.approx(mean)


def test_the_range_in_metres_is_taken_as_given() -> None:
    assert sigma_m(TRIANGLE, unknown(3), 0.25) == 0.25
    assert closeness(at((0, 0, 0), (2, 0, 0)), 4.0)[0, 1] == pytest.approx(math.exp(-0.25))


ROW = at((0, 0, 0), (1, 0, 0), (3, 0, 0), (7, 0, 0))


@pytest.mark.parametrize(
    ("mutual", "expected"),
    [
        # Everybody's partners, nearest robots' distances being 1, 1, 2, 4.
        (unknown(4), 6 * 1.5),
        (sharing(4, _01=0.5), 2.5 * 1),
        (sharing(4, _02=0.26, _23=0.5), 2.5 * 3.5),
        # Of three partners the two that most is shared with: 0: 3, 7; 1: 1; 2: 3; 3: 7.
        (sharing(4, _01=0.3, _02=0.5, _03=0.4), 2.5 * 3),
        # Not more than a quarter: no partners, and too far.
        (sharing(4, _01=0.25), 1 / 2),
        (sharing(4, _01=0.0, _02=0.0, _03=0.0, _12=0.0, _13=0.0, _23=0.0), 0.75),
    ],
)
def test_shared_is_two_and_a_half_times_the_distance_to_the_robots_that_most_is_shared_with(
    mutual, expected: float
) -> None:
    assert shared_sigma_m(np.square(ROW), mutual) == pytest.approx(expected)


def test_too_few_partners_tell_nothing() -> None:
    # One pair, two partners of nine robots, which stand 1 m apart in a row.
    distance_m = at(*((x, 0, 0) for x in range(9)))
    assert shared_sigma_m(np.square(distance_m), sharing(9, _05=0.9)) == 6.0
    assert shared_sigma_m(np.square(distance_m[:4, :4]), sharing(4, _03=0.9)) == 7.5


@pytest.mark.parametrize("order", [[0, 1, 2], [0, 2, 1], [2, 1, 0]])
def test_of_those_as_near_whoever_may_share_more_speaks(order: list[int]) -> None:
    # 1 and 2 are as near to 0, to rounding; of 2 nothing is known.
    squared_m2 = np.square(at((0, 0, 0), (0.1 + 0.2, 0, 0), (0, 0.3, 0)))
    mutual = sharing(3, _01=0.1)
    rows = np.array(order)
    assert shared_sigma_m(reordered(squared_m2, rows), reordered(mutual, rows)) == pytest.approx(0.3 / 2)


def test_where_most_stand_in_one_place_the_mean_distance_is_the_range() -> None:
    distance_m = at(*[(0, 0, 0)] * 5, (6, 0, 0))
    assert shared_sigma_m(np.square(distance_m), unknown(6)) == pytest.approx(distance_m.mean())


def test_an_unknown_overlap_is_not_zero() -> None:
    distance_m = at((0, 0, 0), (2, 0, 0))
    near = math.exp(-4 / 9)
    assert matrix(distance_m, unknown(2), 0.9, 3.0)[0, 1] == pytest.approx(near)
    assert matrix(distance_m, sharing(2, _01=0.0), 0.9, 3.0)[0, 1] == pytest.approx(0.1 * near)


def test_a_share_told_by_one_of_two_is_unknown() -> None:
    np.testing.assert_array_equal(
        mutual_overlap(np.array([[1, 0.5, np.nan], [0.25, 1, 0.75], [0.5, np.nan, 1]])),
        [[1, 0.375, np.nan], [0.375, 1, np.nan], [np.nan, np.nan, 1]],
    )


@pytest.mark.parametrize(
    ("mutual", "q"),
    [
        (sharing(4, _02=0.5, _12=0.8), 0.4),
        # The better of two chains.
        (sharing(4, _02=0.5, _12=0.8, _03=0.7, _13=0.7), 0.49),
        # A chain over two robots is none.
        (sharing(4, _02=0.9, _23=0.9, _13=0.9), None),
        # Who sees nothing of what the other's companion sees will see nothing of the other's view.
        (sharing(4, _02=0.9, _12=0.0), 0.0),
        # A robot that neither shares much with tells nothing of the two.
        (sharing(4, _02=0.25, _12=0.25), None),
        (sharing(4, _02=0.0, _12=0.0, _03=0.26, _13=0.1), 0.026),
        (sharing(4, _02=0.9), None),
        # Where it is known the best chain does not matter.
        (sharing(4, _01=0.1, _02=0.9, _12=0.9), 0.1),
    ],
)
def test_what_is_unknown_is_what_the_best_chain_passes_on(mutual: Floats, q: float | None) -> None:
    S = similarity(mutual, np.square(ROW), 0.6, 2.0)
    near = math.exp(-1 / 4)
    assert S[0, 1] == pytest.approx(near if q is None else 0.6 * q + 0.4 * near)


@pytest.mark.parametrize("count", [5, 30, 60])
@pytest.mark.parametrize("known", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("most", [0.3, 1.0])
def test_every_chain_counts_of_few_and_of_many(count: int, known: float, most: float) -> None:
    rng = np.random.default_rng(count)
    mutual = np.where(rng.uniform(size=(count, count)) < known, rng.uniform(0, most, (count, count)), np.nan)
    mutual = np.tril(mutual, -1) + np.tril(mutual, -1).T
    np.fill_diagonal(mutual, 1.0)
    S = similarity(mutual, np.ones((count, count)), 1.0, 1.0)
    for i, j in zip(*np.tril_indices(count, -1), strict=True):
        steps = [(mutual[i, k], mutual[k, j]) for k in range(count) if k not in (i, j)]
        chains = [a * b for a, b in steps if not math.isnan(a * b) and max(a, b) > 0.25]
        best = max(chains, default=math.exp(-1))
        assert S[i, j] == pytest.approx(best if math.isnan(mutual[i, j]) else mutual[i, j])


@given(seed=seeds, count=counts, alpha=st.floats(0, 1))
def test_eq_16_mixes_overlap_and_closeness(seed: int, count: int, alpha: float) -> None:
    position_m, overlap = swarm(seed, count, known=1.0)
    distance_m = distances(position_m)
    expected = alpha * (overlap + overlap.T) / 2 + (1 - alpha) * closeness(distance_m, 4.0)
    np.testing.assert_allclose(matrix(distance_m, overlap, alpha, 4.0), expected, rtol=0, atol=1e-14)


places_m = st.floats(-1e3, 1e3) | st.sampled_from([0.0, 1.0, 2.0]) | st.floats(-1e-9, 1e-9)


@given(data=st.data(), count=counts, alpha=st.floats(0, 1), sigma=st.sampled_from(SIGMAS) | st.floats(1e-300, 1e300))
@settings(max_examples=200)
def test_similarities_are_symmetric_from_0_to_1_and_1_on_the_diagonal(data, count: int, alpha: float, sigma) -> None:
    position_m = data.draw(arrays(np.float64, (count, 3), elements=places_m))
    overlap = data.draw(arrays(np.float64, (count, count), elements=st.floats(0, 1) | st.just(math.nan)))
    np.fill_diagonal(overlap, 1.0)
    S = matrix(distances(position_m), overlap, alpha, sigma)
    # NaN is not at least 0.
    assert ((S >= 0) & (S <= 1)).all()
    np.testing.assert_array_equal(S, S.T)
    np.testing.assert_array_equal(np.diag(S), np.ones(count))
    near = closeness(distances(position_m), sigma_m(distances(position_m), mutual_overlap(overlap), sigma))
    assert ((near >= 0) & (near <= 1)).all()


@by_sigma
@given(seed=seeds, count=counts)
def test_the_order_of_robots_does_not_matter(sigma: Sigma, seed: int, count: int) -> None:
    position_m, overlap = swarm(seed, count)
    order = np.random.default_rng(seed).permutation(count)
    S = matrix(distances(position_m), overlap, 0.4, sigma)
    shuffled = matrix(distances(position_m[order]), reordered(overlap, order), 0.4, sigma)
    np.testing.assert_allclose(shuffled, reordered(S, order), rtol=0, atol=1e-12)


@by_sigma
@given(seed=seeds, count=counts)
def test_the_frame_of_the_world_does_not_matter(sigma: Sigma, seed: int, count: int) -> None:
    position_m, overlap = swarm(seed, count)
    rng = np.random.default_rng(seed)
    moved_m = Rotation.random(rng=rng).apply(position_m) + rng.uniform(-50, 50, 3) if count else position_m
    S = matrix(distances(position_m), overlap, 0.4, sigma)
    np.testing.assert_allclose(matrix(distances(moved_m), overlap, 0.4, sigma), S, rtol=0, atol=1e-10)


@by_itself
@given(seed=seeds, count=counts, scale=st.floats(1e-6, 1e6))
def test_the_scale_of_the_world_does_not_matter(sigma: Sigma, seed: int, count: int, scale: float) -> None:
    position_m, overlap = swarm(seed, count)
    distance_m = distances(position_m)
    S = matrix(distance_m, overlap, 0.4, sigma)
    np.testing.assert_allclose(matrix(scale * distance_m, overlap, 0.4, sigma), S, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("sigma", "near"), [(1e-200, 0.0), (5e-324, 0.0), (1e200, 1.0)])
def test_a_range_next_to_nothing_and_one_beyond_the_world_are_ranges(sigma: float, near: float) -> None:
    distance_m = at((0, 0, 0), (0, 0, 0), (5, 0, 0))
    expected = [[1, 1, near], [1, 1, near], [near, near, 1]]
    np.testing.assert_array_equal(matrix(distance_m, unknown(3), 0.5, sigma), expected)
    np.testing.assert_array_equal(closeness(distance_m, sigma), expected)


@by_sigma
def test_all_robots_in_one_place_are_as_close_as_can_be(sigma: Sigma) -> None:
    np.testing.assert_array_equal(matrix(np.zeros((3, 3)), unknown(3), 0.5, sigma), np.ones((3, 3)))
