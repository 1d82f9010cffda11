from __future__ import annotations

import sys

import numpy as np
import pytest
from covista_schemas.errors import MissingExtraError
from covista_service.bench import group, group_costs
from covista_service.bench.group_swarm import affinity, plant
from covista_service.grouping.selection import SelectionOptions, choose


def test_a_swarm_is_the_same_for_the_same_seed_and_another_for_another() -> None:
    one, same, other = plant(40), plant(40), plant(40, seed=2)
    assert (one.similarity() == same.similarity()).all()
    assert not np.allclose(one.position_m, other.position_m)


@pytest.mark.parametrize("count", [1, 2, 7, 90, 400])
def test_a_swarm_has_groups_of_two_to_eight_the_last_cut_short(count: int) -> None:
    swarm = plant(count)
    sizes = np.sort(np.bincount(swarm.groups))
    assert (len(swarm), len(swarm.position_m), swarm.overlap.shape) == (count, count, (count, count))
    assert sizes[-1] <= 8
    assert (sizes[1:] >= 2).all()


@pytest.mark.parametrize("count", [200, 800])
def test_however_large_the_swarm_a_dozen_see_something_of_each_other(count: int) -> None:
    neighbours = (plant(count).overlap > 0).sum(axis=1) - 1
    assert 9 < neighbours.mean() < 15


def test_planted_groups_are_found_again() -> None:
    swarm = plant(100)
    found = choose(swarm.similarity(), SelectionOptions()).labels
    together = found[:, None] == found
    planted = swarm.groups[:, None] == swarm.groups
    assert (together == planted).mean() > 0.98


def test_news_of_one_robot_changes_its_row_and_column_and_its_group() -> None:
    swarm = plant(30)
    after = swarm.after(4)
    changed = swarm.overlap != after.overlap
    assert changed[4].any()
    changed[4] = changed[:, 4] = False
    assert not changed.any()
    assert np.flatnonzero(swarm.groups != after.groups).tolist() == [4]


def test_what_the_station_holds_of_a_swarm_gives_its_similarity() -> None:
    swarm = plant(30)
    assert affinity(swarm).similarity(0.5) == pytest.approx(swarm.similarity(), abs=1e-12)
    nothing_known = affinity(swarm, np.zeros((30, 30), np.bool_))
    assert np.isnan(nothing_known.overlap).sum() == 30 * 29


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(group, "_ROUNDS", 1)
    for marks in ("MARKS_MS", "GAIN_MARKS_MS", "POSE_MARKS_MS"):
        monkeypatch.setattr(group, marks, {12: 1e6})
    monkeypatch.setattr(group, "_FASTER", 1e-9)


@pytest.mark.usefixtures("small")
def test_regroupings_and_news_have_rows_and_those_with_marks_are_judged() -> None:
    rows = {row.case: row for row in group.rows(long=False)}
    marked = {"n12": "<= 1e+06 ms and peer / 1e-09", "gain_n12": "<= 1e+06 ms", "row_n12": "<= 1e+06 ms"}
    reported = ("see_n12", "read_n12", "read_unknown_n12", "weigh_n12", "evaluate_n12")
    assert {case: row.mark for case, row in rows.items()} == marked | dict.fromkeys(reported, "reported")
    assert {(row.bench, row.unit, row.holds) for row in rows.values()} == {("group", "ms", True)}
    assert {case for case, row in rows.items() if row.peer_median} == {"n12"}


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize(("mark_ms", "faster"), [(0.0, 1e-9), (1e6, 1e9)])
def test_a_regrouping_that_misses_its_mark_or_its_peer_does_not_hold(
    mark_ms: float, faster: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(group, "MARKS_MS", {12: mark_ms})
    monkeypatch.setattr(group, "_FASTER", faster)
    assert not next(group.rows(long=False)).holds


@pytest.mark.usefixtures("small")
def test_a_large_swarm_has_no_peer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(group, "_PEER_UP_TO", 11)
    row = next(group.rows(long=False))
    assert (row.case, row.mark, row.peer) == ("n12", "<= 1e+06 ms", None)


@pytest.mark.usefixtures("small")
def test_without_its_peer_the_benchmark_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sklearn.cluster", None)
    with pytest.raises(MissingExtraError, match="bench"):
        next(group.rows(long=False))


def test_costs_are_told_by_the_number_of_robots(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(group_costs, "_ROUNDS", 1)
    monkeypatch.setattr(group_costs, "COUNTS", (5, 9))
    monkeypatch.setattr(group_costs, "SLOW_UP_TO", 5)
    rows = {row.case: row for row in group_costs.rows(long=False)}
    always = ["cost_adaptive", "cost_gain", "cost_gain_warm", "cost_read", "cost_row"]
    slow = ["cost_silhouette", "cost_fiedler", "cost_paper"]
    memory = ["memory_held", "memory_regroup"]
    cases = [f"{case}_n5" for case in always + slow + memory] + [f"{case}_n9" for case in always + memory]
    assert list(rows) == cases
    assert all(row.unit == ("MB" if case.startswith("memory") else "ms") for case, row in rows.items())
    assert all(row.median > 0 for row in rows.values())


def test_a_swarm_ten_times_as_large_takes_a_hundred_times_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(group_costs, "_ROUNDS", 1)
    monkeypatch.setattr(group_costs, "COUNTS", (16, 256))
    monkeypatch.setattr(group_costs, "SLOW_UP_TO", 0)
    held = {row.case: row.median for row in group_costs.rows(long=False)}
    # Three matrices of float64 and one of truth values, with room for a quarter more robots at most.
    assert 25 * 256**2 <= 1e6 * held["memory_held_n256"] < 1.05 * 25 * (1.25 * 256) ** 2
    assert held["memory_regroup_n256"] > 8 * 256**2 / 1e6 > held["memory_held_n16"]
