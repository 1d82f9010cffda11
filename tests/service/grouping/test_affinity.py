"""Whatever happens, the matrices kept row by row are those computed from scratch."""

import math
from itertools import count as numbers
from itertools import pairwise

import numpy as np
import pytest
from covista_service.grouping.affinity import FARTHEST_M, Affinity
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from tests.service.grouping.swarms import Floats, distances

# More than a block of sums, and more than the first room can take.
CROWD = 48
SIGMAS = ("shared", "std", 2.5)
# Below it a robot stands where the other stands, as far as squares can tell.
TINY_M = 1e-100
coordinates = st.floats(-1e3, 1e3) | st.integers(-2, 2).map(float) | st.floats(1e-12, 1e-9)
positions = st.tuples(coordinates, coordinates, coordinates)
shares = st.floats(0, 1) | st.sampled_from([0.0, 0.25, 0.5, 1.0])
picks = st.integers(0, 10_000)
Pair = tuple[str, str]


def mean_and_spread(distance_m: Floats) -> tuple[float, float]:
    apart_m = distance_m[np.triu_indices(len(distance_m), 1)]
    return (float(apart_m.mean()), float(apart_m.std())) if len(apart_m) else (0.0, 0.0)


def standard(distance_m: Floats) -> float:
    mean, spread = mean_and_spread(distance_m)
    if mean == 0:
        return 1.0
    return spread if spread > 1e-6 * mean else mean


def shared(distance_m: Floats, mutual: Floats) -> float:
    """Two and a half times the median distance to the two that each has most in common with, of more than a quarter."""
    count = len(distance_m)
    if count < 2:
        return 1.0
    partners_m: list[float] = []
    nearest_m: list[float] = []
    strange: list[bool] = []
    for i in range(count):
        q, apart_m = np.delete(mutual[i], i), np.delete(distance_m[i], i)
        # Of those who share as much the nearer; of those as near whoever is not known to share little.
        order = np.lexsort((apart_m, -q))[:2]
        partners_m += apart_m[order[q[order] > 0.25]].tolist()
        nearest_m.append(apart_m.min())
        strange.append(bool((q[apart_m <= nearest_m[-1] * (1 + 1e-9)] <= 0.25).all()))
    if len(partners_m) >= count / 2:
        sigma = 2.5 * float(np.median(partners_m))
    elif sum(strange) >= count / 4:
        sigma = float(np.median(np.array(nearest_m)[strange])) / 2
    else:
        sigma = 6 * float(np.median(nearest_m))
    return sigma or float(distance_m.mean()) or 1.0


def chained(mutual: Floats) -> Floats:
    """What is unknown, by the best chain over a third robot with whom one of the two shares more than a quarter.

    NaN where there is none.
    """
    result, others = mutual.copy(), np.arange(len(mutual))
    for i, own in enumerate(mutual):
        # Row j, column k: the two steps from i over k to j.
        passed_on = own * mutual
        told = (np.fmax(own, mutual) > 0.25) & ~np.isnan(passed_on)
        told[:, i] = told[others, others] = False
        best = np.where(told, passed_on, -1.0).max(axis=1)
        result[i] = np.where(np.isnan(own), np.where(best >= 0, best, np.nan), own)
    return result


def mixed(q: Floats, near: Floats, alpha: float) -> Floats:
    """Eq. 16, where nobody knows by distance alone."""
    S = np.where(np.isnan(q), near, alpha * q + (1 - alpha) * near)
    np.fill_diagonal(S, 1.0)
    return S


def off(found: Floats, expected: Floats) -> float:
    """The largest difference; NaN, which is not small, if one is NaN."""
    assert found.shape == expected.shape
    return float(np.abs(found - expected).max(initial=0.0))


class Swarm(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        self.position_m: dict[str, tuple[float, ...]] = {}
        self.shares: dict[Pair, float] = {}
        self.mutual: dict[Pair, float] = {}
        self.away: dict[str, dict[Pair, tuple[float | None, float | None]]] = {}
        self.names = numbers()

    @initialize(
        smoothing=st.sampled_from([1.0, 0.3]),
        alpha=st.floats(0, 1),
        # Names sort as they come, or otherwise.
        kinds=st.sampled_from([1, 7]),
        crowd=st.sampled_from([0, 14, 30]),
        seed=picks,
    )
    def begin(self, smoothing: float, alpha: float, kinds: int, crowd: int, seed: int) -> None:
        self.affinity = Affinity(smoothing)
        self.alpha = alpha
        self.kinds = kinds
        for place in np.random.default_rng(seed).uniform(-20, 20, (crowd, 3)).tolist():
            self.enter(self.fresh(seed), tuple(place))

    def fresh(self, pick: int) -> str:
        number = next(self.names)
        return f"{(pick + number) % self.kinds}-{number:04}"

    def robot(self, pick: int) -> str:
        return sorted(self.position_m)[pick % len(self.position_m)]

    def enter(self, name: str, position_m: tuple[float, ...]) -> None:
        self.affinity.add(name, position_m)
        self.position_m[name] = position_m

    def tell(self, a: str, b: str, q_a: float | None, q_b: float | None) -> None:
        """What the matrix is told, and what should come of it."""
        self.affinity.see(a, b, q_a, q_b)
        self.expect(a, b, q_a, q_b)

    def expect(self, a: str, b: str, q_a: float | None, q_b: float | None) -> None:
        for pair, q in (((a, b), q_a), ((b, a), q_b)):
            self.shares.pop(pair, None)
            if q is not None:
                self.shares[pair] = q
        pair = min(a, b), max(a, b)
        held = self.mutual.pop(pair, None)
        if q_a is not None and q_b is not None:
            newest = (q_a + q_b) / 2
            # The very same arithmetic, for a quarter is a threshold.
            smooth = held is not None and self.affinity.smoothing != 1
            self.mutual[pair] = held + self.affinity.smoothing * (newest - held) if smooth else newest

    @precondition(lambda self: len(self.position_m) < CROWD)
    @rule(pick=picks, position_m=positions)
    def join(self, pick: int, position_m: tuple[float, ...]) -> None:
        self.enter(self.fresh(pick), position_m)

    @precondition(lambda self: len(self.position_m) < CROWD - 12)
    @rule(pick=picks, centre_m=positions, sharing=st.booleans())
    def a_troop_joins(self, pick: int, centre_m: tuple[float, ...], sharing: bool) -> None:
        rng = np.random.default_rng(pick)
        troop = [self.fresh(pick) for _ in range(rng.integers(2, 12))]
        for name in troop:
            self.enter(name, tuple((np.array(centre_m) + rng.normal(0, 2, 3)).tolist()))
        if sharing:
            for a, b in pairwise(troop):
                self.tell(a, b, *rng.uniform(0, 1, 2).tolist())

    @precondition(lambda self: self.position_m)
    @rule(pick=picks, position_m=positions)
    def move(self, pick: int, position_m: tuple[float, ...]) -> None:
        robot = self.robot(pick)
        self.affinity.move(robot, position_m)
        self.position_m[robot] = position_m

    @precondition(lambda self: len(self.position_m) > 1)
    @rule(pick=picks, other=picks)
    def meet(self, pick: int, other: int) -> None:
        a, b = self.robot(pick), self.robot(other)
        self.affinity.move(a, self.position_m[b])
        self.position_m[a] = self.position_m[b]

    @precondition(lambda self: len(self.position_m) > 1)
    @rule(pick=picks, step=picks, q_a=shares | st.none(), q_b=shares | st.none())
    def see(self, pick: int, step: int, q_a: float | None, q_b: float | None) -> None:
        a, b = self.robot(pick), self.robot(pick + 1 + step % (len(self.position_m) - 1))
        self.tell(a, b, q_a, q_b)

    @precondition(lambda self: len(self.position_m) > 1)
    @rule(pick=picks, q=shares)
    def see_around(self, pick: int, q: float) -> None:
        robots, rng = sorted(self.position_m), np.random.default_rng(pick)
        a = self.robot(pick)
        for b in rng.permutation(robots)[:5].tolist():
            if b != a:
                self.tell(a, b, q, float(rng.uniform()))

    @precondition(lambda self: self.position_m)
    @rule(pick=picks, count=st.integers(0, 12), known=st.floats(0, 1))
    def see_row(self, pick: int, count: int, known: float) -> None:
        rng, robot = np.random.default_rng(pick), self.robot(pick)
        others = [name for name in rng.permutation(sorted(self.position_m)).tolist() if name != robot][:count]
        q = rng.choice([0.0, 0.25, 0.7, 1.0], (len(others), 2))
        q[rng.uniform(size=q.shape) > known] = np.nan
        self.affinity.see_row(robot, others, q)
        for other, (q_own, q_other) in zip(others, q.tolist(), strict=True):
            self.expect(robot, other, *(None if math.isnan(share) else share for share in (q_own, q_other)))

    @precondition(lambda self: self.position_m)
    @rule(pick=picks)
    def go_stale(self, pick: int) -> None:
        robot = self.robot(pick)
        for other in self.position_m.keys() - {robot}:
            self.tell(robot, other, None, None)

    @precondition(lambda self: self.position_m)
    @rule(pick=picks)
    def leave(self, pick: int) -> None:
        robot = self.robot(pick)
        self.affinity.remove(robot)
        del self.position_m[robot]
        told = {pair for pair in self.shares if robot in pair}
        self.away[robot] = {(a, b): (self.shares.get((a, b)), self.shares.get((b, a))) for a, b in told}
        for pair in told:
            del self.shares[pair]
        for pair in [pair for pair in self.mutual if robot in pair]:
            del self.mutual[pair]

    @precondition(lambda self: self.away and len(self.position_m) < CROWD)
    @rule(pick=picks, position_m=positions)
    def come_back(self, pick: int, position_m: tuple[float, ...]) -> None:
        robot = sorted(self.away)[pick % len(self.away)]
        self.enter(robot, position_m)
        for (a, b), (q_a, q_b) in self.away.pop(robot).items():
            if a in self.position_m and b in self.position_m:
                self.tell(a, b, q_a, q_b)

    @invariant()
    def equals_the_batch(self) -> None:
        robots = sorted(self.position_m)
        assert self.affinity.robots == tuple(robots)
        # Before anything is read, for which rows are sorted.
        sigma_m = {sigma: self.affinity.sigma_m(sigma) for sigma in ("shared", "std")}
        place = {robot: row for row, robot in enumerate(robots)}
        overlap, mutual = np.full((2, len(robots), len(robots)), np.nan)
        for (a, b), q in self.shares.items():
            overlap[place[a], place[b]] = q
        for (a, b), q in self.mutual.items():
            mutual[place[a], place[b]] = mutual[place[b], place[a]] = q
        np.fill_diagonal(overlap, 1.0)
        np.fill_diagonal(mutual, 1.0)
        np.testing.assert_array_equal(self.affinity.overlap, overlap)
        np.testing.assert_allclose(self.affinity.mutual, mutual, rtol=0, atol=1e-12)
        distance_m = distances(np.array([self.position_m[robot] for robot in robots]).reshape(-1, 3))
        np.testing.assert_allclose(self.affinity.distance_m, distance_m, rtol=1e-12, atol=0)
        self._equals_by_range(distance_m, mutual, sigma_m)

    def _equals_by_range(self, distance_m: Floats, mutual: Floats, sigma_m: dict[str, float]) -> None:
        mean, spread = mean_and_spread(distance_m)
        q = chained(mutual)
        for sigma, expected in (("shared", shared(distance_m, mutual)), ("std", standard(distance_m)), (2.5, 2.5)):
            # Where distances are next to equal, their spread is a matter of digits, and Eq. 15 is 0.
            if sigma != "std" or spread == 0 or spread > 1e-3 * mean:
                assert self.affinity.sigma_m(sigma) == pytest.approx(expected, rel=1e-9)
                assert sigma_m.get(sigma, sigma) == pytest.approx(expected, rel=1e-9)
            near = np.exp(-np.square(distance_m / max(expected, TINY_M)))
            assert off(self.affinity.closeness(sigma), near) <= 1e-12
            for alpha in (0.0, self.alpha, 1.0):
                assert off(self.affinity.similarity(alpha, sigma), mixed(q, near, alpha)) <= 1e-12


TestSwarm = Swarm.TestCase
# To shrink two hundred steps takes longer than a test may, and then nothing is told of them.
TestSwarm.settings = settings(
    max_examples=6,
    stateful_step_count=200,
    deadline=None,
    phases=[Phase.explicit, Phase.reuse, Phase.generate],
)


def row(*along_m: float, smoothing: float = 1.0) -> Affinity:
    affinity = Affinity(smoothing)
    for number, x in enumerate(along_m):
        affinity.add(f"r{number}", (x, 0, 0))
    return affinity


@given(smoothing=st.floats(0.05, 1), told=st.lists(st.tuples(shares, shares) | st.none(), max_size=12))
def test_mutual_overlap_is_the_exponential_average_of_what_was_told_since_it_was_unknown(
    smoothing: float, told: list[tuple[float, float] | None]
) -> None:
    affinity = row(0, 1, smoothing=smoothing)
    since: list[float] = []
    for pair in told:
        affinity.see("r1", "r0", *(pair or (None, 0.5)))
        since = [*since, sum(pair) / 2] if pair else []
    if since:
        weights = smoothing * (1 - smoothing) ** np.arange(len(since))[::-1]
        weights[0] = (1 - smoothing) ** (len(since) - 1)
        assert affinity.mutual[0, 1] == pytest.approx(weights @ since, abs=1e-12)
        assert 0 <= affinity.mutual[0, 1] <= 1
    else:
        assert np.isnan(affinity.mutual[0, 1])


def test_without_smoothing_the_newest_stands() -> None:
    affinity = row(0, 1)
    for q in (0.1, 0.7, 0.3):
        affinity.see("r0", "r1", q, q)
    assert affinity.mutual[0, 1] == 0.3


def test_who_comes_back_is_not_averaged_with_what_was_before() -> None:
    affinity = row(0, 1, smoothing=0.1)
    affinity.see("r0", "r1", 1.0, 1.0)
    affinity.remove("r1")
    affinity.add("r1", (1, 0, 0))
    assert np.isnan(affinity.mutual[0, 1])
    affinity.see("r0", "r1", 0.2, 0.2)
    assert affinity.mutual[0, 1] == 0.2


def test_overlap_has_ones_on_the_diagonal_and_says_where_it_is_unknown() -> None:
    affinity = row(0, 1, 2)
    affinity.see("r2", "r0", 0.25, 0.75)
    expected = [[1, np.nan, 0.75], [np.nan, 1, np.nan], [0.25, np.nan, 1]]
    np.testing.assert_array_equal(affinity.overlap, expected)


def test_what_is_read_is_a_copy() -> None:
    affinity = row(0, 1)
    affinity.see("r0", "r1", 0.5, 0.5)
    for name in ("squared_m2", "distance_m", "overlap", "mutual"):
        getattr(affinity, name)[:] = 7
        assert not (getattr(affinity, name) == 7).any()


def test_robots_are_known_by_name() -> None:
    affinity = row(0, 1)
    assert "r1" in affinity
    assert "r2" not in affinity
    assert len(affinity) == 2


@pytest.mark.parametrize("sigma", ["shared", "std"])
def test_a_swarm_that_was_far_apart_can_be_tight_again(sigma) -> None:
    affinity = row(0, 1e8, 3e8)
    for number, x in enumerate((0.0, 1e-4, 3e-4)):
        affinity.move(f"r{number}", (x, 0, 0))
    np.testing.assert_allclose(affinity.closeness(sigma), row(0, 1, 3).closeness(sigma), atol=1e-12)


@pytest.mark.parametrize("count", [0, 1])
@pytest.mark.parametrize("sigma", SIGMAS)
def test_nobody_and_one_alone_have_matrices_too(count: int, sigma) -> None:
    affinity = row(*range(count))
    for matrix in (affinity.similarity(0.5, sigma), affinity.closeness(sigma), affinity.overlap, affinity.mutual):
        np.testing.assert_array_equal(matrix, np.ones((count, count)))
    assert affinity.sigma_m(sigma) == (sigma if isinstance(sigma, float) else 1.0)


WRONG_PLACES = [
    (math.nan, 0, 0),
    (0, math.inf, 0),
    (0, 0, -math.inf),
    (FARTHEST_M, 0, 0),
    (0, -1e300, 0),
    (1, 2),
    (1, 2, 3, 4),
    1,
]


@pytest.mark.parametrize("place", WRONG_PLACES, ids=str)
def test_a_position_that_is_none_is_refused_and_changes_nothing(place) -> None:
    affinity = row(0, 1)
    before = affinity.squared_m2
    with pytest.raises(ValueError, match=r"a position is three finite numbers below 1e\+12 m, that of r1 is"):
        affinity.move("r1", place)
    with pytest.raises(ValueError, match="that of r7 is"):
        affinity.add("r7", place)
    assert affinity.robots == ("r0", "r1")
    np.testing.assert_array_equal(affinity.squared_m2, before)


@pytest.mark.parametrize("q", [-0.001, 1.001, math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("first", [True, False])
def test_a_share_that_is_none_is_refused_and_changes_nothing(q: float, first: bool) -> None:
    affinity = row(0, 1)
    affinity.see("r0", "r1", 0.5, 0.25)
    with pytest.raises(ValueError, match="a share lies from 0 to 1, that of r0 and r1 does not"):
        affinity.see("r0", "r1", *((q, 0.5) if first else (0.5, q)))
    np.testing.assert_array_equal(affinity.overlap, [[1, 0.5], [0.25, 1]])


def test_a_robot_and_itself_are_no_pair() -> None:
    with pytest.raises(ValueError, match="r0 shares all of its view with itself"):
        row(0).see("r0", "r0", 0.5, 0.5)


def test_nobody_joins_twice() -> None:
    affinity = row(0)
    with pytest.raises(ValueError, match="r0 is there already"):
        affinity.add("r0", (1, 1, 1))
    assert len(affinity) == 1


def test_the_farthest_that_robots_may_be_is_no_trouble() -> None:
    almost = 0.999 * FARTHEST_M
    affinity = row(-almost, almost, 0)
    for sigma in SIGMAS:
        assert np.isfinite(affinity.similarity(0.5, sigma)).all()


keyframes = st.lists(st.lists(shares, min_size=1, max_size=4), min_size=1, max_size=6)


@given(smoothing=st.floats(0.05, 0.95), told=keyframes)
def test_of_one_pair_of_pictures_the_last_reading_counts(smoothing: float, told: list[list[float]]) -> None:
    affinity = row(0, 1, smoothing=smoothing)
    for readings in told:
        for number, q in enumerate(readings):
            affinity.see("r0", "r1", q, q, again=number > 0)
    expected = told[0][-1]
    for readings in told[1:]:
        expected += smoothing * (readings[-1] - expected)
    assert affinity.mutual[0, 1] == pytest.approx(expected, abs=1e-12)
    assert 0 <= affinity.mutual[0, 1] <= 1


rows = st.lists(
    st.tuples(st.lists(st.tuples(shares | st.none(), shares | st.none()), min_size=3, max_size=3), st.booleans()),
    max_size=8,
)


@given(smoothing=st.floats(0.05, 1), told=rows)
def test_a_row_at_once_is_its_pairs_one_by_one(smoothing: float, told) -> None:
    at_once, one_by_one = (row(0, 1, 2, 3, smoothing=smoothing) for _ in range(2))
    others = ["r3", "r0", "r2"]
    for pairs, again in told:
        q = np.array([[np.nan if share is None else share for share in pair] for pair in pairs])
        at_once.see_row("r1", others, q, again=again)
        mutual = [one_by_one.see("r1", other, *pair, again=again) for other, pair in zip(others, pairs, strict=True)]
        np.testing.assert_array_equal(at_once.mutual, one_by_one.mutual)
        np.testing.assert_array_equal(at_once.overlap, one_by_one.overlap)
        np.testing.assert_array_equal(at_once._once, one_by_one._once)
        held = one_by_one.mutual[1, [3, 0, 2]].tolist()
        assert mutual == [None if math.isnan(share) else share for share in held]


def test_a_row_of_what_is_no_share_or_of_the_robot_itself_is_refused_and_changes_nothing() -> None:
    affinity = row(0, 1, 2)
    for others, q in ((["r1", "r2"], [[0.5, 1.001], [0, 0]]), (["r1"], [[-0.1, 0]]), (["r0"], [[0.5, 0.5]])):
        with pytest.raises(ValueError, match=r"a share lies from 0 to 1|with itself"):
            affinity.see_row("r0", others, np.array(q))
    affinity.see_row("r0", [], np.zeros((0, 2)))
    assert np.isnan(affinity.mutual[np.triu_indices(3, 1)]).all()


def test_room_for_pairs_follows_the_number_of_robots_and_is_not_made_for_each() -> None:
    affinity, rooms = Affinity(), []
    for number in range(300):
        affinity.add(f"r{number:03}", (number, 0.0, 0.0))
        rooms.append(len(affinity._overlap))
    assert all(room <= max(16, 1.25 * count) for count, room in enumerate(rooms, 1))
    assert len(set(rooms)) < 20
