"""Groups on show change for a clear gain or when the change persists; who comes and goes is another matter."""

from collections.abc import Iterable, Sequence

import numpy as np
import pytest
from covista_service.grouping.continuity import Members
from covista_service.grouping.hysteresis import HysteresisOptions, Pending, Standing, held, weigh
from covista_service.grouping.scores import Contributions
from covista_service.grouping.similarity import Floats
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

NS = 1_000_000_000
AT_ONCE = HysteresisOptions(clear=0.0, persistence_s=0.0)
# Half of what a robot contributes on average, for each that moves.
OPTIONS = HysteresisOptions(clear=0.5, persistence_s=5.0)
ROBOTS = "abcdefgh"


def groups(text: str) -> tuple[Members, ...]:
    """Groups written as "abc de"."""
    return tuple(frozenset(part) for part in text.split())


def labels_of(proposal: str, robots: Sequence[str]) -> NDArray[np.intp]:
    parts = proposal.split()
    return np.array([next(k for k, part in enumerate(parts) if robot in part) for robot in robots], np.intp)


def shown(clusters: Iterable[Members]) -> dict[str, Members]:
    return {f"g{number}": members for number, members in enumerate(clusters, 1)}


def never(labels: NDArray[np.intp]) -> Floats:
    raise AssertionError("nothing is to be judged")


def flat(labels: NDArray[np.intp]) -> Floats:
    """A score that no change betters."""
    return np.ones(len(labels))


def inside(S: Floats, threshold: float = 0.3) -> Contributions:
    """A score of pairs inside groups, half a pair for each of the two."""
    worth = S - threshold
    np.fill_diagonal(worth, 0.0)
    return lambda labels: np.asarray((worth * (labels[:, None] == labels)).sum(axis=1) / 2, np.float64)


def scene(c_to_d: float) -> Floats:
    """The robots a to h: ab and def are groups, gh another; c is .5 like a and b, and `c_to_d` like d, e and f."""
    S = np.full((8, 8), 0.05)
    for group in ([0, 1], [3, 4, 5], [6, 7]):
        S[np.ix_(group, group)] = 0.8
    S[2, :2] = S[:2, 2] = 0.5
    S[2, 3:6] = S[3:6, 2] = c_to_d
    np.fill_diagonal(S, 1.0)
    return S


def step(
    before: Standing,
    proposal: str,
    contributions: Contributions,
    at_s: float = 0.0,
    options: HysteresisOptions = OPTIONS,
    robots: Sequence[str] = ROBOTS,
) -> Standing:
    labels = labels_of(proposal, robots)
    return weigh(shown(before.clusters), robots, labels, contributions, round(at_s * NS), options, before.pending)


BEFORE = Standing(groups("abc def gh"))
MOVED = "ab cdef gh"
SMALL, CLEAR = inside(scene(0.46)), inside(scene(0.8))


def test_what_is_proposed_as_it_stands_is_shown_as_it_is_and_not_judged() -> None:
    assert step(BEFORE, "gh def abc", never) == BEFORE


def test_the_first_groups_are_shown_as_proposed() -> None:
    assert step(Standing(()), "gh abc def", never) == BEFORE


def test_nobody_has_no_groups() -> None:
    assert step(BEFORE, "", never, robots="") == Standing(())


def test_who_has_left_is_dropped_at_once() -> None:
    assert step(BEFORE, "ab def", never, robots="abdef").clusters == groups("ab def")


def test_who_is_new_joins_at_once_the_group_that_shares_most_robots_with_its_own() -> None:
    assert step(BEFORE, "abcx def ghyz", never, robots="abcdefghxyz").clusters == groups("abcx def ghyz")
    # Of the proposed group of x two are shown with def, one with abc, and their move is too small to be shown.
    assert step(BEFORE, "ab cefx d gh", flat, robots="abcdefghx").clusters == groups("abc defx gh")


def test_among_groups_that_share_as_many_the_newcomer_joins_the_smallest_then_the_first() -> None:
    robots = "abcdefghx"
    assert step(BEFORE, "ab chx def g", flat, robots=robots).clusters == groups("abc def ghx")
    assert step(BEFORE, "ab cdx ef gh", flat, robots=robots).clusters == groups("abcx def gh")


def test_newcomers_among_themselves_are_groups_of_their_own() -> None:
    assert step(BEFORE, "abc def gh xy z", never, robots="abcdefghxyz").clusters == groups("abc def gh xy z")


def test_a_clear_change_is_shown_at_once() -> None:
    assert step(BEFORE, MOVED, CLEAR) == Standing(groups(MOVED))


def test_a_small_change_is_shown_when_it_has_persisted() -> None:
    standing = BEFORE
    waiting = Pending(frozenset(groups("abc def")), frozenset(groups("ab cdef")), 10 * NS)
    for at_s in (10.0, 11.0, 14.9):
        standing = step(standing, MOVED, SMALL, at_s)
        assert standing == Standing(BEFORE.clusters, (waiting,))
    assert step(standing, MOVED, SMALL, 15.0) == Standing(groups(MOVED))


def test_a_change_for_the_worse_persists_as_well() -> None:
    worse = inside(scene(0.1))
    waiting = step(BEFORE, MOVED, worse)
    assert waiting.clusters == BEFORE.clusters
    assert step(waiting, MOVED, worse, 5.0).clusters == groups(MOVED)


def test_a_change_that_is_not_proposed_for_once_is_forgotten() -> None:
    standing = step(BEFORE, MOVED, SMALL, 0.0)
    standing = step(standing, "abc def gh", SMALL, 3.0)
    assert standing.pending == ()
    standing = step(standing, MOVED, SMALL, 4.0)
    assert step(standing, MOVED, SMALL, 6.0).clusters == BEFORE.clusters


def test_a_change_that_changes_begins_to_wait_anew() -> None:
    standing = step(BEFORE, MOVED, SMALL, 0.0)
    standing = step(standing, "ab c def gh", SMALL, 4.0)
    assert step(standing, MOVED, SMALL, 6.0).clusters == BEFORE.clusters


@pytest.mark.parametrize("persistence_s", [0.1, 3.0])
def test_what_flickers_is_never_shown(persistence_s: float) -> None:
    standing, options = BEFORE, HysteresisOptions(clear=0.5, persistence_s=persistence_s)
    for at_s in range(60):
        standing = step(standing, (MOVED, "abc def gh", "ab c def gh", "abc def gh")[at_s % 4], SMALL, at_s, options)
        assert standing.clusters == BEFORE.clusters


def test_a_clock_that_was_set_back_does_not_make_a_change_wait_for_longer() -> None:
    standing = step(BEFORE, MOVED, SMALL, 1000.0)
    standing = step(standing, MOVED, SMALL, 1.0)
    assert step(standing, MOVED, SMALL, 6.0).clusters == groups(MOVED)


def test_a_change_goes_on_waiting_while_others_come_and_go() -> None:
    robots = "abcdfghx"
    standing = step(BEFORE, MOVED, flat)
    # e has left one of its groups, and x has joined it.
    standing = step(standing, "ab cdfx gh", flat, 3.0, robots=robots)
    assert standing.clusters == groups("abc dfx gh")
    assert step(standing, "ab cdfx gh", flat, 5.0, robots=robots).clusters == groups("ab cdfx gh")


def test_changes_that_have_no_group_in_common_are_judged_apart() -> None:
    # c moves by a small gain, g and h part by a large one.
    S = scene(0.46)
    S[6, 7] = S[7, 6] = 0.0
    standing = step(BEFORE, "ab cdef g h", inside(S))
    assert standing.clusters == groups("abc def g h")
    assert [change.after for change in standing.pending] == [frozenset(groups("ab cdef"))]


@pytest.mark.parametrize(("contributions", "at_once"), [(SMALL, False), (CLEAR, True)])
@pytest.mark.parametrize("copies", [1, 25])
def test_a_change_is_judged_alike_in_a_large_swarm(contributions: Contributions, at_once: bool, copies: int) -> None:
    """`copies` - 1 times as many robots stand far away, in groups like those of the eight."""
    robots = [f"{robot}{copy:02}" for copy in range(copies) for robot in ROBOTS]

    def apart(labels: NDArray[np.intp]) -> Floats:
        return np.concatenate([contributions(eight) for eight in labels.reshape(copies, 8)])

    before = labels_of("abc def gh", ROBOTS)
    proposed = np.concatenate([labels_of(MOVED, ROBOTS), *[before + 3 * copy for copy in range(1, copies)]])
    everyone = np.concatenate([before + 3 * copy for copy in range(copies)])
    first = weigh({}, robots, everyone, never, 0, OPTIONS)
    standing = weigh(shown(first.clusters), robots, proposed, apart, 0, OPTIONS)
    moved = next(members for members in standing.clusters if "d00" in members)
    assert ("c00" in moved) == at_once
    assert len(standing.pending) == (0 if at_once else 1)


def test_a_gain_where_nobody_contributes_anything_has_to_persist() -> None:
    """Two robots on the verge: whatever they gain together would be any number of times what they have."""
    slight = np.array([[1.0, 0.31], [0.31, 1.0]])
    standing = step(Standing(groups("a b")), "ab", inside(slight), robots="ab")
    assert standing.clusters == groups("a b")
    assert step(standing, "ab", inside(slight), 5.0, robots="ab").clusters == groups("ab")


def test_the_order_of_robots_does_not_matter() -> None:
    order = np.array([5, 2, 7, 0, 1, 6, 4, 3])
    turned = [ROBOTS[k] for k in order]
    for c_to_d in (0.46, 0.8):
        S = scene(c_to_d)
        straight = step(BEFORE, MOVED, inside(S))
        assert step(BEFORE, MOVED, inside(S[np.ix_(order, order)]), robots=turned) == straight


swarms = st.dictionaries(st.sampled_from("abcdefghijkl"), st.integers(0, 4))


def clusters_of(labels: dict[str, int]) -> list[Members]:
    return [frozenset(robot for robot in labels if labels[robot] == each) for each in sorted(set(labels.values()))]


@given(
    moments=st.lists(swarms, min_size=1, max_size=6),
    gain=st.floats(0, 2),
    persistence_s=st.floats(0, 3),
    seed=st.integers(0, 99),
)
def test_whatever_is_proposed_every_robot_that_is_there_stands_in_one_group(
    moments: list[dict[str, int]], gain: float, persistence_s: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    standing = Standing(())
    for at_s, labels in enumerate(moments):
        options = HysteresisOptions(clear=gain, persistence_s=persistence_s)
        proposed = np.array(list(labels.values()), np.intp)
        values = inside(np.maximum.accumulate(rng.uniform(0, 1, (len(labels), len(labels)))))
        standing = weigh(shown(standing.clusters), list(labels), proposed, values, at_s * NS, options, standing.pending)
        assert sorted(robot for members in standing.clusters for robot in members) == sorted(labels)
        assert all(standing.clusters)
        # What is shown and what is pending make up the proposal.
        changed = set().union(*[change.after for change in standing.pending])
        kept = set().union(*[change.before for change in standing.pending])
        assert set(standing.clusters) - kept | changed == set(clusters_of(labels))
        assert kept <= set(standing.clusters)


@given(before=swarms, after=swarms)
def test_without_hysteresis_every_proposal_is_shown_at_once(before: dict[str, int], after: dict[str, int]) -> None:
    proposed = np.array(list(after.values()), np.intp)
    standing = weigh(shown(clusters_of(before)), list(after), proposed, flat, 0, AT_ONCE)
    assert set(standing.clusters) == set(clusters_of(after))
    assert standing.pending == ()


def test_robots_that_stand_there_twice_are_refused() -> None:
    with pytest.raises(ValueError, match="every robot has one row: a stands there more than once"):
        weigh({}, "aba", np.zeros(3, np.intp), never, 0, OPTIONS)


@pytest.mark.parametrize("labels", [np.zeros(2, np.intp), np.zeros((3, 1), np.intp)])
def test_labels_that_do_not_fit_are_refused(labels: NDArray[np.intp]) -> None:
    with pytest.raises(ValueError, match="3 robots have as many labels"):
        weigh({}, "abc", labels, never, 0, OPTIONS)


@given(seed=st.integers(0, 1000), count=st.integers(1, 9), gain=st.floats(0, 0.9))
def test_groups_on_show_mix_into_the_similarity(seed: int, count: int, gain: float) -> None:
    rng = np.random.default_rng(seed)
    S = rng.uniform(0, 1, (count, count))
    S = (S + S.T) / 2
    np.fill_diagonal(S, 1.0)
    labels = rng.integers(0, count, count)
    mixed = held(S, labels, gain)
    together = labels[:, None] == labels
    np.testing.assert_allclose(mixed, np.where(together, S + gain * (1 - S), (1 - gain) * S), atol=1e-15)
    np.testing.assert_array_equal(mixed, mixed.T)
    np.testing.assert_array_equal(np.diag(mixed), 1.0)
    np.testing.assert_array_equal(held(S, labels, 0.0), S)


@pytest.mark.parametrize("robots", [2, 7, 26, 63, 100])
def test_what_is_mixed_is_symmetric_to_the_last_bit(robots: int) -> None:
    rng = np.random.default_rng(robots)
    S = np.tril(rng.random((robots, robots)), -1)
    S = S + S.T + np.eye(robots)
    for gain in (0.05, 0.3, 0.9):
        mixed = held(S, rng.integers(0, robots // 3 + 1, robots), gain)
        np.testing.assert_array_equal(mixed, mixed.T)
        np.testing.assert_array_equal(np.diag(mixed), 1.0)
